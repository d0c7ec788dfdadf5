"""The viscous crawler does what its closed form says."""

import numpy as np

from pneumorph.environment.viscous_crawler import ViscousCrawler
from pneumorph.robot.design import Design

STROKE_MM, GRIP = 20.0, 4.0
CORNERS = np.array([[0, 90], [90, 90], [90, 0], [0, 0]], dtype=float)
# The midpoint rule over 60 steps of an integrand whose curvature is of order grip^2:
# 16 / (24 * 60^2) = 2e-4 of the stroke at most.
INTEGRATION_MM = 2e-4 * STROKE_MM


def walk(design: str, corners: np.ndarray) -> float:
    crawler = ViscousCrawler([Design.parse(design)], stroke_mm=STROKE_MM, grip=GRIP)
    for corner in corners:
        crawler.advance(corner[None], 100)
    return float(crawler.forward_position_mm[0])


def loop_mm(forward: float) -> float:
    """Travel once round the square, for as many legs in front as behind.

    With regulator 1 in front moving alone at grip w of the hind legs, the travel is
    ``forward / 2 * (1 - (w / grip) ln((1 + grip + w) / (1 + w)))`` per leg pair, and the same
    with opposite sign for the hind legs.
    """

    def edge(other: float) -> float:
        return 1.0 - other / GRIP * np.log((1 + GRIP + other) / (1 + other))

    # Path of CORNERS: hind up with front flat, front up, hind down with front full, front down.
    flat, full = edge(1.0), edge(1.0 + GRIP)
    return STROKE_MM * forward * (-flat + full + full - flat)


def test_travel_round_the_square_is_its_closed_form() -> None:
    # Two legs in front at +-22.5 degrees and two behind; cos is the same for both.
    forward = np.cos(np.deg2rad(22.5))
    expected = loop_mm(forward)
    assert abs(expected) > 1.0
    assert abs(walk("1.0.0.2.2.0.0.1", CORNERS) - expected) < INTEGRATION_MM
    # One side of the square, which leaves no error of the rule's steps to the way back.
    hind_up = -STROKE_MM * forward * (1.0 - np.log((2.0 + GRIP) / 2.0) / GRIP)
    assert abs(walk("1.0.0.2.2.0.0.1", CORNERS[:1]) - hind_up) < INTEGRATION_MM
    # Walked backwards, the same loop travels backwards.
    back_first = np.vstack([CORNERS[2], CORNERS[1], CORNERS[0], CORNERS[3]])
    assert abs(walk("1.0.0.2.2.0.0.1", back_first) + expected) < INTEGRATION_MM


def test_one_regulator_alone_gets_nowhere() -> None:
    rng = np.random.default_rng(0)
    gait = np.repeat(rng.uniform(0, 90, (10, 1)), 3, axis=1)
    gait[-1] = 0.0
    # Closed in pressure space, so the travel is the rule's error alone.
    assert abs(walk("1.0.1.0.0.1.0.0", gait)) < INTEGRATION_MM


def test_mirror_image_travels_as_far() -> None:
    gait = np.random.default_rng(1).uniform(0, 90, (10, 3))
    design = Design.parse("1.0.2.2.0.3.0.1")
    mirrored = str(design.mirror())
    # The cosines of mirrored locations agree to rounding only.
    assert abs(walk(str(design), gait) - walk(mirrored, gait)) < 1e-10


def test_marked_robots_move_and_reset_alone() -> None:
    designs = [Design.parse("1.0.0.2.2.0.0.1")] * 2
    crawler, alone = ViscousCrawler(designs), ViscousCrawler(designs[:1])
    command = np.array([[90.0, 0.0]] * 2)
    crawler.advance(command, 50, active=np.array([True, False]))
    alone.advance(command[:1], 50)
    assert crawler.forward_position_mm[1] == 0.0
    assert crawler.forward_position_mm[0] == alone.forward_position_mm[0] != 0.0
    crawler.reset(active=np.array([True, False]))
    np.testing.assert_array_equal(crawler.forward_position_mm, [0.0, 0.0])
