"""A place on a robot for a module."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.catalogue.module import Module
from pneumorph.geometry.attachment import OBLIQUE, mount_pose, same_frame
from pneumorph.geometry.pose import Pose


@dataclass(frozen=True, eq=False)
class Site:
    """A place for a module: where it sits in the robot's frame, and what may be mounted there.

    Attributes:
        pose: The site's frame in the robot's.
        modules: The modules that are allowed, in the order of a design's letters; one of them may
            be given alone.
        face: Where in the site's frame a module's attachment face comes, see
            `pneumorph.geometry.attachment`; None where the site's frame is the module's own.
        name: What messages call it; empty for its number.
        outwards: Whether a leg's own x axis goes along the site where its face looks more than 45
            degrees off that axis, such as a pad on its top; otherwise its face always does.
    """

    pose: Pose
    modules: tuple[Module, ...]
    face: Pose | None = None
    name: str = ""
    outwards: bool = False

    def __post_init__(self) -> None:
        modules = (self.modules,) if isinstance(self.modules, Module) else tuple(self.modules)
        if not modules:
            raise ValueError(f"site {self.name} has no modules, expected at least one")
        object.__setattr__(self, "modules", modules)

    def __repr__(self) -> str:
        names = " or ".join(module.name for module in self.modules)
        return f"Site({self.name + ': ' if self.name else ''}{names})"

    def pose_of(self, module: Module) -> Pose:
        """Where a module's frame is in the robot's when it is mounted here.

        Of a module whose face is where the site has it anyway, and of one whose face is not known,
        the frame is the site's own.
        """
        face = module.face
        if self.face is None or face is None or same_frame(self.face, face):
            return self.pose
        if self.turns(module):
            face = Pose(np.eye(3), face.translation)
        return mount_pose(self.pose.compose(self.face), face)

    def turns(self, module: Module) -> bool:
        """Whether a module's own x axis goes along the site, and not its face's."""
        face = module.face
        return self.outwards and face is not None and face.rotation[0, 0] < OBLIQUE

    @property
    def yaw_deg(self) -> float:
        """Where a module that is mounted here points, seen from above, from forward (0) to the left
        (90) [degrees], 0 to 360."""
        pose = self.pose if self.face is None else self.pose.compose(self.face)
        return pose.yaw_deg

    def with_modules(self, change: Callable[[Module], Module]) -> Site:
        """The same site with each module changed."""
        return replace(self, modules=tuple(change(module) for module in self.modules))
