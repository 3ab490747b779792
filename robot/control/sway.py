"""How the body sways from side to side so that three feet carry it: the crawl's shift of the centre of mass.

While the feet of one side take their steps, the point about which the ground's forces balance must lie on the other side, inside the
triangle of the standing feet. That point goes to and fro as a trapezoid, and moves while all four feet stand. The body follows as a
linear inverted pendulum (Kajita et al., 2001) has to: y'' = (g / h)(y - p). For a periodic p that motion is known in closed form,
harmonic by harmonic: each is p's, divided by 1 + (h / g) w^2. So a quick crawl sways little, and a slow one as far as p itself.
The series: docs/concepts/control.md#swaying-gaits.
"""

from __future__ import annotations

from math import cos, pi, sin, tau

from robot.model.parameters import GRAVITY

Sway = tuple[float, float, float]
"""Displacement (m), velocity (m/s) and acceleration (m/s2), to the left."""

HARMONICS = (1, 3, 5)


def sway(phase: float, period: float, reach: float, change: float, height: float) -> Sway:
    """The body's sway at `phase` (0 to 1) of a period in s. The balance point is `reach` (m) to the left in the first half of the
    period, then to the right; it changes sides within the share `change` of the period, around phases 0 and 0.5. `height` is that of
    the centre of mass, m.
    """
    place = speed = push = 0.0
    for k in HARMONICS:
        rate = tau * k / period
        width = pi * k * change
        wave = 4.0 * reach / (pi * k) * sin(width) / width  # formula: Fourier series of a trapezoid
        share = wave / (1.0 + rate * rate * height / GRAVITY)
        s, c = share * sin(tau * k * phase), share * cos(tau * k * phase)
        place, speed, push = place + s, speed + rate * c, push - rate * rate * s
    return (place, speed, push)
