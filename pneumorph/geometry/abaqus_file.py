"""Refuse an Abaqus file of which meshio would leave out regions, or put them elsewhere."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from pneumorph.geometry.mesh import MeshError
from pneumorph.geometry.region_names import NODE_SETS

_REGIONS = ("sheet", "skin", *NODE_SETS)


def check_abaqus_file(path: Path, asked: Iterable[str] = ()) -> None:
    """Look through the keywords of an Abaqus input file.

    meshio reads nodes, elements, element sets and node sets, the latter by numbers alone. It keeps
    the last block of nodes, gives the sets that stand in lines of elements to the first blocks in
    turn, and reads an included file without its sets.

    Args:
        path: The file.
        asked: Regions that must be there, besides those that a leg may have.

    Raises:
        MeshError: It has several blocks of nodes, includes a file, sections of several materials,
            sets that come to be elsewhere or are made of other sets, or a region that is a surface
            or stands in several blocks.
    """
    lines = _keyword_lines(path)
    if sum(keyword == "NODE" for keyword, _, _ in lines) > 1:
        raise _refusal(
            path,
            "its nodes are in several *NODE blocks, such as those of several parts or a reference "
            "point, expected one: the last alone would be read",
        )
    if any(keyword == "INCLUDE" for keyword, _, _ in lines):
        raise _refusal(
            path, "it includes another file, expected all in one: sets of that would be lost"
        )
    materials = sorted({own.get("MATERIAL", "") for key, own, _ in lines if key == "SOLID SECTION"})
    if len(materials) > 1:
        raise _refusal(
            path,
            f"its solid sections are of {len(materials)} materials ({', '.join(materials)}), "
            "expected one: a part has one solid material",
        )
    _check_element_sets(path, [own.get("ELSET") for key, own, _ in lines if key == "ELEMENT"])
    _check_regions(path, lines, (*_REGIONS, *asked))


def _check_element_sets(path: Path, sets: list[str | None]) -> None:
    """Refuse sets in lines of elements that meshio would give to other elements.

    Raises:
        MeshError: One is there twice, or after elements that are in none.
    """
    named = [each for each in sets if each]
    if len({*named}) < len(named) or named != sets[: len(named)]:
        raise _refusal(
            path,
            "its *ELEMENT lines have an ELSET twice, or one after a line that has none, expected "
            "one of its own for each: others would be given to wrong elements; write *ELSET blocks",
        )


def _check_regions(
    path: Path, lines: list[tuple[str, dict[str, str], bool]], regions: tuple[str, ...]
) -> None:
    """Refuse regions that meshio would not read.

    Raises:
        MeshError: A region is a surface or stands in several blocks, or a set is made of others.
    """
    sets = Counter((key, own.get(key)) for key, own, _ in lines if key in ("ELSET", "NSET"))
    sets.update(("ELSET", own.get("ELSET")) for key, own, _ in lines if key == "ELEMENT")
    for keyword, own, of_names in lines:
        name = own.get("NAME" if keyword == "SURFACE" else keyword, "")
        region = name in regions or name.startswith("cavity")
        if keyword == "SURFACE" and region and not (sets["ELSET", name] or sets["NSET", name]):
            raise _refusal(
                path,
                f"its *SURFACE {name!r} is made of faces of elements, which are not read, expected "
                "shell elements (S3) on the solid's nodes in an element set of that name, or for "
                f"{' and '.join(NODE_SETS[:2])} a node set",
            )
        if of_names and (keyword == "ELSET" or region):
            raise _refusal(
                path,
                f"its *{keyword} {name!r} is made of other sets, expected numbers: those are lost",
            )
        if region and sets[keyword, name] > 1:
            raise _refusal(
                path,
                f"its {keyword} {name!r} is in {sets[keyword, name]} blocks, expected one: the "
                "last alone would be read",
            )


def _keyword_lines(path: Path) -> list[tuple[str, dict[str, str], bool]]:
    """Keywords with what is given in their lines, and whether names stand below instead of
    numbers."""
    found: list[tuple[str, dict[str, str], bool]] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        if line.startswith("**") or not line.strip():
            continue
        if line.startswith("*"):
            keyword, *rest = line[1:].split(",")
            parts = [each.partition("=") for each in rest]
            own = {key.strip().upper(): value.strip() for key, _, value in parts}
            found.append((keyword.strip().upper(), own, False))
        elif found and found[-1][0] in ("ELSET", "NSET"):
            keyword, own, of_names = found[-1]
            names = not line.partition(",")[0].strip().isnumeric()
            found[-1] = (keyword, own, of_names or names)
    return found


def _refusal(path: Path, told: str) -> MeshError:
    return MeshError(f"mesh file {path}: {told}")
