"""Who may take part in a graph over a network, and in what: the security file, read and checked.

* `settings`: what a file says, as values; `load_security` reads one and refuses it with file and line,
* `document`: a YAML text whose parts know their lines; `errors`: the error of all of them,
* `files`: the files that it names: certificates, keys and passwords; `handshake`: whether a certificate would be taken by others,
* `authority`: a small authority of one's own, with a folder for each process that it knows.

How it is enforced is the transport's affair; see `actors.transport.zenoh.access`.
"""

from actors.transport.security.document import SecurityError
from actors.transport.security.settings import AccessRule, Secret, Security, Tls, User, load_security

__all__ = ["AccessRule", "Secret", "Security", "SecurityError", "Tls", "User", "load_security"]
