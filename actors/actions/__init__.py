"""Actions: clients and servers of goals, and the Protocols between them.

Public here are the policies with a limit for goals that arrive while another one runs: ``@COUNT.serve(arrivals=queue(3))``.
"""

from __future__ import annotations

from actors.contracts.contracts import parallel, queue

__all__ = ["parallel", "queue"]
