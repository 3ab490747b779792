"""Security files: made, read, refused."""

import asyncio
import tempfile
from pathlib import Path

from actors import Child, Node, run
from actors.transport.security import AccessRule, Secret, Security, SecurityError, Tls, User, load_security
from actors.transport.security.authority import Certificate, create, read_certificate
from actors.transport.zenoh import ZenohConfig, ZenohTransport

folder = Path(tempfile.mkdtemp())
(robot, desk) = create(folder, ["robot", "desk"], days=30, passwords=False)


async def main() -> None:
    config = ZenohConfig(gossip_port=0, security=load_security(robot))
    async with run(Child(Node, name="gait"), transport=ZenohTransport(config)):
        ...


asyncio.run(main())

# -- the file

wrong = robot.read_text().replace("key: key.pem", "key: ../desk/key.pem")
robot.write_text(wrong)
try:
    load_security(robot)
except SecurityError as error:
    assert f"{robot}:5: tls.key: " in str(error) and "is not the key of" in str(error)
else:
    raise AssertionError("it was taken")

security: Security = load_security(desk)
tls: Tls = security.tls
who: Certificate = read_certificate(tls.certificate)
assert (who.name, tls.mutual) == ("desk", True) and (who.ends - who.begins).days == 30
user: User | None = security.user
rules: tuple[AccessRule, ...] | None = security.access
assert user is None and rules is None  # no password, and everything is allowed
hidden = Secret("swordfish")
assert repr(hidden) == "<secret>" and hidden.reveal() == "swordfish"
