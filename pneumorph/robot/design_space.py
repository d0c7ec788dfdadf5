"""Every design that may be built, in a defined order."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from pneumorph.robot.choice_paths import WeighedPaths
from pneumorph.robot.design import Design
from pneumorph.robot.design_choices import DesignChoices
from pneumorph.robot.design_codes import DesignCodes
from pneumorph.robot.emptying_rules import emptying_rules

DESIGN_LIMIT = 100_000
"""Most designs that are listed one by one."""


@dataclass(frozen=True)
class DesignSpace(DesignChoices):
    """Designs of a hub with ``N`` locations, ``M`` regulators and a range of legs.

    The defaults are the paper's (section III-B): 41202 assignments, of which 6972 remain once
    the regulators' names are made canonical.

    Designs are listed one by one and numbered in order where they are at most `DESIGN_LIMIT`, else
    numbered by what is chosen at each location (`DesignCodes`).
    """

    @cached_property
    def is_listed(self) -> bool:
        """Whether designs are few enough to be listed one by one."""
        if not self.symmetries:
            return self.paths.count <= DESIGN_LIMIT
        # At most as many count as one as there are products of the symmetries.
        most = DESIGN_LIMIT * len(self._products)
        return self.paths.count <= most and self._listed is not None

    @property
    def size(self) -> int:
        """Number of designs, exact; where they are not listed, before designs that symmetries turn
        into each other are counted as one."""
        return len(self.designs) if self.symmetries and self.is_listed else self.paths.count

    def __len__(self) -> int:
        return self.size

    def __iter__(self) -> Iterator[Design]:
        return iter(self.designs)

    def __getitem__(self, index: int) -> Design:
        return self.designs[index] if self.is_listed else self._codes.design(int(index))

    def __contains__(self, design: object) -> bool:
        if self.is_listed:
            return design in self._index
        return isinstance(design, Design) and self.holds(design) and self.form(design)[0] == design

    @cached_property
    def designs(self) -> tuple[Design, ...]:
        """Every design, ordered by what the first location carries, then by what the second does,
        and so on: no leg comes first, then legs by their regulators, then by their kind.

        Raises:
            ValueError: There is none, or there are more than `DESIGN_LIMIT`.
        """
        if not self.is_listed or self._listed is None:
            raise ValueError(
                f"the design space holds more than {DESIGN_LIMIT} designs, expected fewer: "
                "they are listed one by one; allow fewer legs, options or regulators"
            )
        if not self._listed:
            raise ValueError(
                "the design space is empty: no design keeps to its options, counts of legs and "
                f"regulators, and exclusions together; {emptying_rules(self)}"
            )
        return self._listed

    @cached_property
    def _listed(self) -> tuple[Design, ...] | None:
        """Every design; None where there are too many."""
        return _listed(self)

    @cached_property
    def first(self) -> Design:
        """The first of `designs`; where they are not listed, the design that stands for the first
        choice.

        Raises:
            ValueError: There is none.
        """
        if self.is_listed:
            return self.designs[0]
        return self.form(self.of_options(next(iter(self.paths))))[0]

    def some(self, count: int) -> list[Design]:
        """A number of designs, always the same: the first ones, again and again where there are
        fewer; drawn where they are not listed."""
        if self.is_listed:
            return [self[place % len(self)] for place in range(count)]
        return [self[int(index)] for index in self.drawn(count, np.random.default_rng(0))]

    @cached_property
    def _codes(self) -> DesignCodes:
        return DesignCodes(self._options[0])

    def holds(self, design: Design) -> bool:
        """Whether a design keeps to all rules, by whatever names of regulators."""
        numbers = self._codes.options(design.canonical() if self.canonical else design)
        return numbers is not None and self.paths.allows(numbers)

    @cached_property
    def _index(self) -> dict[Design, int]:
        return {design: index for index, design in enumerate(self.designs)}

    def index(self, design: Design) -> int:
        """Place in `designs` of the design that stands for a design.

        Raises:
            ValueError: The design is not one of this space.
        """
        self.check(design)
        form = self.form(design)[0]
        found = self._index.get(form) if self.is_listed else self._code(form)
        if found is None:
            raise ValueError(
                f"design {design} is not one of the space: its rules on options, regulators or "
                "exclusions do not allow it"
            )
        return found

    def _code(self, form: Design) -> int | None:
        numbers = self._codes.options(form)
        if numbers is None or not self.paths.allows(numbers):
            return None
        return int(self._codes.codes(np.array([numbers]))[0])

    def parse(self, text: str) -> Design:
        """Read a design and check that it belongs to the space; canonical if the space is.

        Raises:
            ValueError: The text is no design, or the design is not of this space.
        """
        design = Design.parse(text)
        self.check(design)
        return self.form(design)[0]

    @cached_property
    def one_hot(self) -> np.ndarray:
        """One-hot rows of all designs, (design, feature) float32; see `Design.one_hot`."""
        return np.stack([self._one_hot_of(design) for design in self.designs])

    @cached_property
    def feature_count(self) -> int:
        """Numbers of a design's one-hot row."""
        return self._one_hot_of(self.first).size

    def _one_hot_of(self, design: Design) -> np.ndarray:
        return design.one_hot(self.regulator_count, self.module_count, self.cavity_count)

    def features(self, indices: np.ndarray) -> np.ndarray:
        """One-hot rows of designs, (..., feature) float32; see `Design.one_hot`.

        Args:
            indices: Of the designs, (...).
        """
        if self.is_listed:
            return self.one_hot[indices]
        options = self._codes.digits(np.ravel(indices)).T
        blocks = [rows[at] for rows, at in zip(self._blocks, options, strict=True)]
        return np.concatenate(blocks, axis=1).reshape(*np.shape(indices), -1)

    @cached_property
    def _blocks(self) -> list[np.ndarray]:
        """What a one-hot row says of a location with each of its options, (option, entry) each."""
        found = []
        for location, options in enumerate(self._options[0]):
            alone = [
                Design.of(self.location_count, [] if option is None else [option])
                for option in options
            ]
            rows = np.stack([self._one_hot_of(each) for each in alone])
            found.append(rows.reshape(len(alone), self.location_count, -1)[:, location])
        return found

    def options_of(self, indices: np.ndarray) -> np.ndarray:
        """Numbers of the options that designs have at each location, (n, location).

        Args:
            indices: Of the designs, (n,).
        """
        if self.is_listed:
            return self._listed_options[indices]
        return self._codes.digits(indices)

    def options_of_members(self, index: int) -> np.ndarray:
        """`options_of` a design and of all that are counted as one with it, (member, location)."""
        return np.array([self._codes.options(each) for each in self.members(self[index])])

    @cached_property
    def _listed_options(self) -> np.ndarray:
        return np.array([self._codes.options(design) for design in self.designs])

    def indices_of(self, options: np.ndarray) -> np.ndarray:
        """Indices of the designs that stand for those of these options, (n,).

        Args:
            options: Numbers of the options at each location, (n, location), each a path of `paths`.
        """
        if not self.is_listed and not self.symmetries:
            return self._codes.codes(options)  # each stands for itself
        forms = (self.form(self.of_options(row))[0] for row in options)
        if self.is_listed:
            return np.array([self._index[form] for form in forms])
        return self._codes.codes(np.array([self._codes.options(form) for form in forms]))

    def drawn(self, count: int, rng: np.random.Generator) -> np.ndarray:
        """Indices of designs drawn independently, (count,): each as probable as any other; where
        they are not listed, before designs that symmetries turn into each other count as one."""
        if self.is_listed:
            return rng.integers(len(self), size=count)
        zeros = [np.zeros(each) for each in self.paths.option_counts]
        return self.indices_of(WeighedPaths(self.paths, zeros).sample(count, rng))

    def images(self, indices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The designs that stand for the mirror images of designs, and what drives them.

        Args:
            indices: Of the designs, (n,).

        Returns:
            Indices (n,), its own of a robot without a mirror, and for each regulator of the image
            that of the design, from 0, which it must do as for the two to walk mirrored paths;
            unused ones fill up in rising order (n, M).

        Raises:
            ValueError: An image is not one of the space.
        """
        if self.is_listed:
            return self.mirror_index[indices], self.mirror_regulator[indices]
        found = [self._image(int(index)) for index in indices]
        return np.array([index for index, _ in found]), np.array([order for _, order in found])

    def _image(self, index: int) -> tuple[int, np.ndarray]:
        known = self._known_images
        if index not in known:
            if len(known) >= DESIGN_LIMIT:
                known.clear()
            design = self[index]
            image, order = self.image_of(design)
            code = self._code(image)
            if code is None:
                raise ValueError(_no_image(design, image))
            known[index] = (code, np.array(order) - 1)
        return known[index]

    @cached_property
    def _known_images(self) -> dict[int, tuple[int, np.ndarray]]:
        return {}

    def image_of(self, design: Design) -> tuple[Design, tuple[int, ...]]:
        """The mirror image of a design and the regulators of it; its own without a mirror."""
        to = self._mirror
        return self.form(design if to is None else design.moved(to, reflected=True))

    @cached_property
    def mirror_index(self) -> np.ndarray:
        """`images` of all designs: their indices, (design,).

        Raises:
            ValueError: An image is not one of the space.
        """
        images = _images(self)
        for design, (image, _) in zip(self.designs, images, strict=True):
            if image not in self._index:
                raise ValueError(_no_image(design, image))
        return np.array([self._index[image] for image, _ in images])

    @cached_property
    def mirror_regulator(self) -> np.ndarray:
        """`images` of all designs: what drives each regulator of them, (design, M)."""
        return np.array([order for _, order in _images(self)]) - 1

    def twin(self, index: int) -> int:
        """The lesser index of a design and its mirror image, which count as one."""
        images, _ = self.images(np.array([index]))
        return min(int(index), int(images[0]))


def _no_image(design: Design, image: Design) -> str:
    return (
        f"the mirror image {image} of design {design} is not one of the space, "
        "expected options and exclusions that are each other's images, or no mirror "
        "(mirror = false in a robot's file)"
    )


@lru_cache(maxsize=4)
def _listed(space: DesignSpace) -> tuple[Design, ...] | None:
    """As `DesignSpace._listed`, once for equal spaces: a robot's file is read again and again while
    its settings come together."""
    paths = np.array(list(space.paths), dtype=int).reshape(-1, space.location_count)
    if space.symmetries:
        paths = paths[space.stand_for_all(paths)]
    return None if len(paths) > DESIGN_LIMIT else tuple(map(space.of_options, paths))


@lru_cache(maxsize=4)
def _images(space: DesignSpace) -> list[tuple[Design, tuple[int, ...]]]:
    """`DesignSpace.image_of` of all designs, likewise once for equal spaces."""
    return [space.image_of(design) for design in space.designs]
