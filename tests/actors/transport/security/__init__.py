"""The security file: reading, checking, and the authority that makes one."""
