"""The TOML file of a robot's description."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from os.path import relpath
from pathlib import Path
from typing import Any

import tomli_w

from pneumorph.base.artefact import write_text
from pneumorph.base.plain_values import plain


def write_description(robot: Any, path: Path) -> Path:
    """Write a `RobotDescription`, which has this as its method `write`; raises as that."""
    if path.suffix != ".toml":
        raise ValueError(f"path is {path}, expected a file that ends in .toml")
    _ = robot.physics.physics, robot.worlds  # refuse what is none
    there = Path(relpath(robot.folder.resolve(), path.parent.resolve()))
    text = tomli_w.dumps(_without_none(_table(robot, there)))
    return write_text(path, text)


def _table(robot: Any, there: Path) -> dict[str, Any]:
    """The description as its file has it, in a folder from which its own is ``there``."""
    content = _placed(_said(robot, ""), there, "catalogue_folder")
    content["hub"] = _placed(_said(robot.hub, "hub"), there, "mesh")
    content["modules"] = {
        name: _placed(_said(each, f"modules.{name}"), there, "part", "mesh")
        for name, each in robot.modules.items()
    }
    content["physics"] = {"based_on": robot.physics.based_on, **_physics(robot, there)}
    if robot.sites:
        content["sites"] = [
            _said(each, f"sites[{number}]") for number, each in enumerate(robot.sites)
        ]
    for name in {"ring", "designs"} & set(content):
        content[name] = _said(getattr(robot, name), name)
    for name in ("folder", "file"):  # where it is, and not what is in it
        content.pop(name, None)
    return content


def _physics(robot: Any, there: Path) -> dict[str, Any]:
    """What differs from the physics, with the map of the ground named from another folder."""
    changes: dict[str, Any] = robot.physics.said
    ground = changes.get("ground", {})
    if "map" in ground:
        changes["ground"] = {**ground, "map": _placed(ground["map"], there, "path")}
    return changes


def _said(described: Any, place: str) -> dict[str, Any]:
    """The fields of a description that are not as by default, as a file has them."""
    content = {}
    for each in fields(described):
        name = f"{place}.{each.name}".removeprefix(".")
        made = each.default if each.default_factory is MISSING else each.default_factory()
        value = plain(getattr(described, each.name), name)
        if value is not None and (made is MISSING or value != plain(made, name)):
            content[each.name] = value
    return content


def _placed(content: dict[str, Any], there: Path, *names: str) -> dict[str, Any]:
    """With files that are named from one folder named from another, where that one is ``there``."""
    return {
        name: (there / each).as_posix() if name in names and each is not None else each
        for name, each in content.items()
    }


def _without_none(value: Any) -> Any:
    """Without what is None in tables: TOML has no word for it, and what is left out is so."""
    if isinstance(value, Mapping):
        return {name: _without_none(each) for name, each in value.items() if each is not None}
    return [_without_none(each) for each in value] if isinstance(value, list) else value
