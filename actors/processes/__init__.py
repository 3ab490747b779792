"""Children in processes of their own: ``Child(..., process=True)`` and ``Supervisor(..., process=True)``.

The boundary lies at `supervision.peers.Life`: a supervisor runs a child of another process as it runs any other, so strategies, intensity,
backoff, order and reports are the same, and nothing of them is written twice. `life.ProcessLife` is that life. It launches a process,
gives it an `Order` (the declaration, its place in the tree, and what earlier lives have left), and from then on exchanges `messages` with it:

* parent to process: `StopAsked`, `CrashAsked`;
* process to parent: `Ready`, log lines, reports, what is known of its nodes, and at last `Over` with the reason of its end.

In the process, `child_tree.ChildTree` runs the child below a supervisor of one temporary child, which has the path of the child's real
supervisor. So the child's own `ChildTask` decides how its life has ended, and the parent repeats that end by returning or raising.

There are two kinds of processes behind the Protocol `life.Process`:

* `os_process`: a process of the system, on the real clock: an interpreter of its own, or one that a `zygote` has forked, which has imported for
  all of them (`forked`, `prefork`). The control channel is an inherited socket pair (`channel`, `main`). The parent
  sees the end by the process descriptor, and a loop that hangs by missing beats; the process sees the end of its parent by the closed
  channel (`watchdog`), ends its nodes in order, and is gone after 5 s in any case.
* `simulated`: a system of its own on the same virtual loop, for `Rig`: deterministic, without a real process.

Messages between nodes do not use the control channel but the transport, as between any two processes (`rendezvous`).
`parent` brings what a process tells into the system of its parent: log lines, reports, the records of nodes. `pickling` copies errors with their tracebacks
as text.
"""
