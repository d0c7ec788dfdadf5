"""Which designs of a described robot may be built: its rules, and symmetries from its sites."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from pneumorph.base.checked import Checked, Count, CountOrNone
from pneumorph.geometry.pose import Pose, rotation_about
from pneumorph.robot.broken_rules import broken_rules
from pneumorph.robot.design import MINIMUM_LEGS, Design, module_letter
from pneumorph.robot.design_space import DesignSpace

_SAME_MM = 0.02
"""Places that are this near are one: files have them rounded to a hundredth [mm]."""
_SAME = 1e-4
"""Likewise of the entries of rotations."""
_REFLECTION = np.diag([1.0, -1.0, 1.0])


@dataclass(frozen=True)
class DesignRules(Checked):
    """Options, counts, exclusions and symmetries; see `pneumorph.robot.design_space`."""

    usual: str | None = None
    """Design that walks where none is named; by default one that is its own mirror image, with
    most legs."""
    minimum_legs: CountOrNone = MINIMUM_LEGS
    """Fewest legs."""
    maximum_legs: Count | None = None
    """Most legs; by default as many as there are sites."""
    minimum_regulators: CountOrNone = 0
    """Fewest different regulators."""
    maximum_regulators: Count | None = None
    """Most different regulators; by default all."""
    options: tuple[str, ...] = ()
    """What each site may carry, such as `0 * b*`; by default nothing, or any of its modules on any
    regulator."""
    exclusions: tuple[str, ...] = ()
    """Numbers of sites of which one at most may carry a leg, such as `0 1`."""
    canonical: bool = True
    """Count designs as one that differ only by the names of their regulators."""
    mirror: bool = True
    """Whether the robot is its own mirror image about the forward axis, so that what is learned of
    a design holds for its image."""
    same: tuple[str, ...] = ()
    """Count designs as one that these turn into each other: `mirror`, or a turn about the z axis in
    degrees such as `180`. A file may have one alone, and turns as numbers."""

    @classmethod
    def upgraded(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """Rules as a file has them, with `same` as the list of texts that it is."""
        now = dict(content)
        if "same" in now:
            same = now["same"]
            listed = same if isinstance(same, list | tuple) else [same]
            now["same"] = [_as_text(each) for each in listed]
        return now

    def space(
        self,
        poses: Sequence[Pose],
        modules: Sequence[tuple[str, ...]],
        regulator_count: int,
    ) -> DesignSpace:
        """The designs of sites.

        Args:
            poses: Each site's frame in the robot's.
            modules: Names of the modules that are allowed at each site.
            regulator_count: How many regulators there are.

        Raises:
            ValueError: A rule asks for what there is not, a symmetry maps a site to none, or no
                design is left.
        """
        count = len(poses)
        if self.options and len(self.options) != count:
            raise ValueError(
                f"designs.options has {len(self.options)} entries, expected one for each of the "
                f"{count} sites"
            )
        mirror = _mirror(poses, modules) if self.mirror else "none"
        symmetries = tuple(_symmetry(text, poses, modules) for text in self.same)
        try:
            space = DesignSpace(
                location_count=count,
                regulator_count=regulator_count,
                minimum_legs=self.minimum_legs,
                maximum_legs=count if self.maximum_legs is None else self.maximum_legs,
                canonical=self.canonical,
                options=self.options or _usual_options(modules),
                minimum_regulators=self.minimum_regulators,
                maximum_regulators=self.maximum_regulators,
                exclusions=self.exclusions,
                mirror=mirror,
                symmetries=symmetries,
            )
        except ValueError as error:
            told = str(error)
            for text, symmetry in zip(self.same, symmetries, strict=True):
                told = told.replace(f"the symmetry {symmetry!r}", f"the symmetry {text!r}")
            raise ValueError(f"designs: {told}") from error
        for location, kinds in enumerate(space.kinds):
            names = modules[location]
            if max(kinds, default=0) >= len(names):
                allowed = (f"{module_letter(place)} ({each})" for place, each in enumerate(names))
                raise ValueError(
                    f"designs.options[{location}] names module {module_letter(max(kinds))}, "
                    f"expected {' or '.join(allowed)}: those of the site"
                )
        most = self.maximum_regulators or regulator_count
        if most > regulator_count:
            raise ValueError(
                f"designs.maximum_regulators is {most}, expected at most {regulator_count}, as "
                "many regulators as there are"
            )
        try:
            _ = space.first
        except ValueError as error:
            raise ValueError(f"designs: {error}") from error
        self._check_usual(space)
        return space

    def refuse_unused(self, space: DesignSpace, is_ring: bool) -> None:
        """Refuse sites and regulators that no design uses.

        Args:
            space: The designs, as `space` made them.
            is_ring: Whether the sites are those of a ring, of which some may have to stay empty.

        Raises:
            ValueError: There is one.
        """
        for location, legs in enumerate(space.fittings):
            if not legs and not is_ring:
                raise ValueError(
                    f"designs.options[{location}] is {space.options[location]!r}, expected a "
                    "module besides: a site without one is none; leave it out"
                )
        space.refuse_idle_regulators(
            "physics.regulator_count",
            "see options, exclusions, maximum_legs and maximum_regulators of [designs]",
        )

    def refuse_repeated(self) -> None:
        """Refuse an exclusion that names a site twice, and an exclusion or a symmetry that is given
        twice, in whatever words.

        Raises:
            ValueError: There is one.
        """
        for place, text in enumerate(self.exclusions):
            for site, count in Counter(map(int, text.split())).items():
                if count > 1:
                    raise ValueError(
                        f"designs.exclusions[{place}] is {text!r} and names site {site} {count} "
                        "times, expected each site once; another site may be meant"
                    )
        rules: dict[str, list[Any]] = {
            "exclusions": [frozenset(map(int, text.split())) for text in self.exclusions],
            "same": [each if each == "mirror" else float(each) % 360.0 for each in self.same],
        }
        for name, meant in rules.items():
            for place, each in enumerate(meant):
                first = meant.index(each)
                if first < place:
                    texts = getattr(self, name)
                    raise ValueError(
                        f"designs.{name}[{first}] is {texts[first]!r} and designs.{name}[{place}] "
                        f"is {texts[place]!r}, which say the same, expected each once; another "
                        "may be meant"
                    )

    def _check_usual(self, space: DesignSpace) -> None:
        if self.usual is None:
            return
        try:
            design = Design.parse(self.usual)
            space.check(design)
        except ValueError as error:
            raise ValueError(f"designs.usual: {error}") from error
        if not space.holds(design):
            raise ValueError(
                f"designs.usual is {self.usual}, expected a design that options, exclusions "
                f"and counts of [designs] allow; {broken_rules(space, design)}"
            )


def _as_text(turn: Any) -> Any:
    """A turn that a file has as a number, such as 72 or 72.0, as text; anything else as it is."""
    return f"{turn:.12g}" if type(turn) in (int, float) else turn


def _usual_options(modules: Sequence[tuple[str, ...]]) -> tuple[str, ...]:
    """No leg or any module on any regulator; nothing to say of one module everywhere."""
    texts = tuple(
        " ".join(["0", *(f"{module_letter(kind) if kind else ''}*" for kind in range(len(names)))])
        for names in modules
    )
    return () if set(texts) == {"0 *"} else texts


def _mirror(poses: Sequence[Pose], modules: Sequence[tuple[str, ...]]) -> str:
    images = _images(
        [Pose(_REFLECTION @ each.rotation @ _REFLECTION, _REFLECTION @ each.translation)
         for each in poses],
        poses, modules, "designs.mirror is true, and the mirror image", "set mirror = false",
    )  # fmt: skip
    return "radial" if images == list(reversed(range(len(poses)))) else " ".join(map(str, images))


def _symmetry(text: str, poses: Sequence[Pose], modules: Sequence[tuple[str, ...]]) -> str:
    if text == "mirror":
        return text
    try:
        angle = float(text)
    except ValueError:
        raise ValueError(
            f'designs.same has {text!r}, expected "mirror" or a turn in degrees such as "180": '
            'same = ["mirror"], or same = ["72"]'
        ) from None
    turn = Pose(rotation_about("z", angle))
    images = _images(
        [turn.compose(each) for each in poses], poses, modules,
        f"designs.same has {text!r}, and that turn", "leave it out",
    )  # fmt: skip
    return " ".join(map(str, images))


def _images(
    moved: Sequence[Pose],
    poses: Sequence[Pose],
    modules: Sequence[tuple[str, ...]],
    what: str,
    remedy: str,
) -> list[int]:
    """Which site each moved one lies on.

    Raises:
        ValueError: One lies on none, or on one of other modules.
    """
    images = []
    for site, pose in enumerate(moved):
        here = [
            place
            for place, other in enumerate(poses)
            if np.abs(other.translation - pose.translation).max() < _SAME_MM
            and np.abs(other.rotation - pose.rotation).max() < _SAME
        ]
        like = [place for place in here if modules[place] == modules[site]]
        if len(like) != 1:
            found = f"site {here[0]}, of other modules" if here else _nearest(pose, poses)
            raise ValueError(
                f"{what} of site {site} lies on {found}, expected one that is like it; {remedy}, "
                "or move the sites"
            )
        images.append(like[0])
    return images


def _nearest(pose: Pose, poses: Sequence[Pose]) -> str:
    """How far what lies on no site is from the nearest one."""
    apart_mm = [float(np.linalg.norm(each.translation - pose.translation)) for each in poses]
    nearest = int(np.argmin(apart_mm))
    place = ", ".join(f"{x:.4g}" for x in pose.translation)
    turn = Rotation.from_matrix(poses[nearest].rotation.T @ pose.rotation)
    turned = f"turned by {np.degrees(turn.magnitude()):.3g} degrees"
    how = f"which is {turned}"
    if apart_mm[nearest] >= _SAME_MM:
        how = f"{apart_mm[nearest]:.3g} mm away"
        if np.abs(poses[nearest].rotation - pose.rotation).max() >= _SAME:
            how += f" and {turned}"
    return f"no site (it is at {place} mm, the nearest site is {nearest}, {how})"
