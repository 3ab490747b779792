"""The running side of `actors.supervision.declarations`: Erlang/OTP's supervision, carried out on raw asyncio tasks.

`running` holds the supervisor that a system runs; `seam` what it asks of the system; `reasons`, `report`, `refs` and
`errors` the values that it hands out. The rest is its inside: `core` handles events, `requests` what users ask for,
`incarnation` owns one child's task, `lane` keeps the order of stops and starts, `window` counts restarts.
"""
