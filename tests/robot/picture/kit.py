"""What the tests of the pictures share: a recording made by hand, chunks of rays, and a PNG reader of its own."""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

from robot.geometry.planar import Pose2
from robot.model.kinematics import inverse
from robot.model.parameters import FOOT_RADIUS, STAND_HEIGHT
from robot.model.stance import nominal_feet
from robot.picture.recording import Recording
from robot.picture.tracer import CHUNK
from robot.scenes.scene import Scene
from robot.sim.simulation import Truth

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def standing(pose: Pose2, height: float = STAND_HEIGHT + FOOT_RADIUS) -> Truth:
    """A robot that stands at `pose`."""
    return Truth(
        position=np.array((pose.x, pose.y, height)),
        quaternion=np.array((np.cos(pose.yaw / 2.0), 0.0, 0.0, np.sin(pose.yaw / 2.0))),
        velocity=np.zeros(3),
        angular_velocity=np.zeros(3),
        joints=inverse(nominal_feet(STAND_HEIGHT)).joints,
        fallen=False,
        lying=False,
        touching=(),
        power=0.0,
    )


def recorded(scene: Scene, pose: Pose2 | None = None) -> Recording:
    """A walk of two seconds along x that ends at `pose`, the scene's start by default."""
    pose = pose or scene.start
    times = [k / 50.0 for k in range(101)]
    return Recording(
        scene=scene,
        backend="kinematic",
        truth=standing(pose),
        time=2.0,
        times=times,
        trail=[(pose.x - 0.5 * (2.0 - t), pose.y) for t in times],
        footprints=[(pose.x - 0.3, pose.y + 0.15)],
        path=((pose.x, pose.y), (pose.x + 2.0, pose.y)),
    )


def rays_through(targets: NDArray[np.float64], eye: NDArray[np.float64]) -> NDArray[np.float32]:
    """Unit rays from the eye through points (n, 3), as (3, n), filled up to whole chunks with the last one."""
    rays = targets - eye
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    whole = np.pad(rays, ((0, -len(rays) % CHUNK), (0, 0)), mode="edge")
    return np.ascontiguousarray(whole.T.astype(np.float32))


def decoded(data: bytes) -> NDArray[np.uint8]:
    """The image in a PNG file of eight-bit RGB, by the letter of RFC 2083 as far as our writer goes; checks every checksum."""
    assert data.startswith(SIGNATURE)
    chunks: list[tuple[bytes, bytes]] = []
    place = len(SIGNATURE)
    while place < len(data):
        (length,) = struct.unpack(">I", data[place : place + 4])
        kind, body = data[place + 4 : place + 8], data[place + 8 : place + 8 + length]
        (checksum,) = struct.unpack(">I", data[place + 8 + length : place + 12 + length])
        assert checksum == zlib.crc32(kind + body)
        chunks.append((kind, body))
        place += 12 + length
    assert [chunks[0][0], chunks[-1]] == [b"IHDR", (b"IEND", b"")]
    width, height, depth, colour, packing, filtering, interlace = struct.unpack(">IIBBBBB", chunks[0][1])
    assert (depth, colour, packing, filtering, interlace) == (8, 2, 0, 0, 0)
    raw = zlib.decompress(b"".join(body for kind, body in chunks if kind == b"IDAT"))
    rows = np.frombuffer(raw, dtype=np.uint8).reshape(height, 1 + 3 * width)
    image = np.zeros((height, 3 * width), dtype=np.uint8)
    above = np.zeros(3 * width, dtype=np.uint8)
    for number, row in enumerate(rows):
        assert row[0] in (0, 2), "only the filters 'none' and 'up' are read here"
        above = row[1:] + (above if row[0] == 2 else 0)
        image[number] = above
    return image.reshape(height, width, 3)
