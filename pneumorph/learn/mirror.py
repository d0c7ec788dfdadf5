"""What a robot's experience says about its mirror image."""

from __future__ import annotations

import numpy as np

from pneumorph.robot.design_space import DesignSpace


class MirrorImage:
    """Translates transitions of designs into those of their mirror images.

    The mirror image of a robot, driven by the same pressures, walks the mirrored path, which goes
    as far forward. Its canonical name may number the regulators differently, so the regulators of
    actions are permuted.
    """

    def __init__(self, space: DesignSpace) -> None:
        """Take the images of a space's designs."""
        self._images = space.images

    def designs(self, designs: np.ndarray) -> np.ndarray:
        """Index of each design's image, shape (n,)."""
        return self._images(designs)[0]

    def once(self, designs: np.ndarray) -> np.ndarray:
        """Index of one of each design and its image, always the same one, shape (n,)."""
        return np.minimum(designs, self.designs(designs))

    def actions(self, designs: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """Actions for the images of ``designs`` (n,), one or more each, shape (n, k M)."""
        regulator = self._images(designs)[1][:, np.newaxis, :]
        one_by_one = actions.reshape(len(designs), -1, regulator.shape[-1])
        return np.take_along_axis(one_by_one, regulator, axis=2).reshape(actions.shape)
