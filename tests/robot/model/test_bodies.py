"""The robots that come with the package weigh, and turn as heavily, as their makers' descriptions say."""

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
