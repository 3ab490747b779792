"""The settings of Zenoh that a security file asks for."""

from __future__ import annotations

from actors.transport.security import Security
from actors.transport.zenoh.access import access_control


def secured_settings(security: Security) -> dict[str, object]:
    """By their paths. They are to count more than all others, so that nothing else opens a link without TLS."""
    tls, user, password = security.tls, security.user, security.password
    link: dict[str, object] = {
        "root_ca_certificate": tls.authority,
        "listen_certificate": tls.certificate,
        "listen_private_key": tls.key,
        "connect_certificate": tls.certificate if tls.mutual else None,
        "connect_private_key": tls.key if tls.mutual else None,
        "enable_mtls": tls.mutual,
        "verify_name_on_connect": False,  # gossip tells addresses; a process is known by the name in its certificate
        "close_link_on_expiration": True,
    }
    settings: dict[str, object] = {
        "transport/link/protocols": ["tls"],
        **{f"transport/link/tls/{name}": value for name, value in link.items()},
        "scouting/multicast/enabled": False,
        "adminspace/enabled": False,
    }
    if user is not None and password is not None:
        known = {"dictionary_file": user.users} if user.users else {}
        settings["transport/auth/usrpwd"] = {"user": user.name, "password": password.reveal(), **known}
    if security.access is not None:
        settings["access_control"] = access_control(security.access)
    return settings
