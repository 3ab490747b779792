"""The robots that come with the package have the figures of their makers' descriptions."""

from __future__ import annotations

import pytest

from robot.model.bodies import BODIES

PUBLISHED = {
    "go2": {
        "body": (6.921, (0.107027, 0.0980771, 0.0244531)),
        "hip": (0.678, (0.00088403, 0.000596003, 0.000479967)),
        "thigh": (1.152, (0.00594973, 0.00584149, 0.000878787)),
        "calf": (0.241352, (0.0014901, 0.00146356, 5.31397e-05)),
    },
    "a2": {
        "body": (19.651, (0.472398, 0.407723, 0.141627)),
        "hip": (1.62, (0.0016644, 0.00161602, 0.00145995)),
        "thigh": (3.079, (0.0293395, 0.0280448, 0.00383794)),
        "calf": (0.407, (0.00511119, 0.00502314, 0.000177746)),
    },
    "b2": {
        "body": (40.8426, (1.73786, 1.66448, 0.343734)),
        "hip": (2.5294, (0.00485541, 0.00370618, 0.00277182)),
        "thigh": (7.4554, (0.085057, 0.0842843, 0.0112538)),
        "calf": (0.679123, (0.0162494, 0.0161173, 0.000398115)),
    },
    "anymal_c": {
        "body": (19.2035, (0.639559, 0.624031, 0.217374)),
        "hip": (2.781, (0.00585729, 0.00491868, 0.00329081)),
        "thigh": (3.071, (0.03025, 0.0298943, 0.00418465)),
        "calf": (0.58842, (0.0101637, 0.00923838, 0.00111927)),
    },
}
"""Mass, kg, and principal moments of inertia, kg m2, of the trunk and of the links of the front left leg, from the sources that `bodies` names."""


@pytest.mark.parametrize("link", ["body", "hip", "thigh", "calf"])
@pytest.mark.parametrize("name", PUBLISHED)
def test_a_link_has_the_published_mass_and_inertia(name: str, link: str) -> None:
    mass, moments = PUBLISHED[name][link]
    model = BODIES[name]
    assert getattr(model, f"{link}_mass") == pytest.approx(mass, rel=5e-4)
    inertia = getattr(model, f"{link}_inertia")
    # Their axes are other ones than ours. What all axes have in common is the sum; the legs of one robot differ by less than 0.5 %.
    assert sum(inertia) == pytest.approx(sum(moments), rel=5e-3)
    assert min(moments) * 0.99 <= min(inertia) and max(inertia) <= max(moments) * 1.01


@pytest.mark.parametrize(
    ("name", "lengths", "torques", "hip", "shoulder", "knee"),
    [
        ("go2", (0.213, 0.213), (23.7, 45.43), (-1.0472, 1.0472), (-1.5708, 3.4907), (-2.7227, -0.83776)),
        ("a2", (0.275, 0.275), (120.0, 180.0), (-1.01, 1.01), (-2.34, 3.15), (-2.77, -0.54)),
        ("b2", (0.35, 0.35), (200.0, 300.0), (-0.87, 0.87), (-0.94, 4.69), (-2.82, -0.43)),
    ],
)
def test_legs_are_as_long_as_strong_and_as_free_as_published(
    name: str,
    lengths: tuple[float, float],
    torques: tuple[float, float],
    hip: tuple[float, float],
    shoulder: tuple[float, float],
    knee: tuple[float, float],
) -> None:
    model = BODIES[name]
    assert (model.thigh, model.calf) == pytest.approx(lengths, abs=1e-3)
    assert (model.torque_limit, *(torque for _, torque in model.knee_torque)) == (torques[0], torques[1], torques[1])
    assert (model.hip_limits, model.shoulder_limits) == (hip, shoulder)
    assert model.knee_limits == pytest.approx(knee, abs=0.01)  # the Go2's foot is not quite below its calf


def test_the_hind_legs_of_anymal_are_its_front_legs_turned_round() -> None:
    model = BODIES["anymal_c"]
    for front, rear in (
        (model.knee_limits, model.knee_rear_limits), (model.shoulder_limits, model.shoulder_rear_limits),
    ):  # fmt: skip
        assert rear == (-front[1], -front[0])
