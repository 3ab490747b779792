"""Supervision as in Erlang/OTP: trees declared as values, and run on raw asyncio tasks.

What users write: `child` and `declarations`, with the options of `policy`. What they get back: the values in `reasons`, `refs`,
`report` and `errors`. What a system runs: `running`; what it is asked for in return: `seam`.

To read how it works: an event (`events`) is entered in the books (`children`, with `entry`, `steps` and `window`), `decide` says
what follows from it (`administer`: from a request), and `executor` carries these `acts` out; `child_task` owns one child's task.
`decide` is pure: it needs no event loop, and its tests are a table of cases.
"""
