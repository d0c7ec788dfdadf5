"""What a misspelt flag may have meant."""

from __future__ import annotations

from pneumorph.base.meant_flags import meant_flags

KNOWN = ["--physics.friction", "--walk.design", "--world-count", "--out", "-h"]


def test_a_flag_is_found_by_its_last_part() -> None:
    assert meant_flags(["--frction", "0.5"], KNOWN) == {"--frction": ["--physics.friction"]}
    assert meant_flags(["--desing=3"], KNOWN) == {"--desing=3": ["--walk.design"]}
    several = [*KNOWN, "--randomisation.friction"]
    assert meant_flags(["--friction"], several) == {
        "--friction": ["--physics.friction", "--randomisation.friction"]
    }


def test_nothing_is_said_of_what_is_known_or_like_nothing() -> None:
    assert meant_flags(["--out", "runs/a", "--world_count", "3", "-x"], KNOWN) == {}
    assert meant_flags(["--colour"], KNOWN) == {}
    # Of whole names the command line's reader tells.
    assert meant_flags(["--wolrd_count=3", "--no-wolrd-count"], KNOWN) == {}
    assert meant_flags(["--space.no-canonical"], ["--space.canonical"]) == {}
