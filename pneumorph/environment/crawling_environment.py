"""Many crawling robots of different designs as one Gymnasium vector environment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from pneumorph.environment.crawling_simulator import (
    RUNNING,
    CrawlingSimulator,
    LeaningSimulator,
    LoadedSimulator,
    RangedSimulator,
    RedrawingSimulator,
    RobotBuilder,
    SimulatorFactory,
    TurningSimulator,
)
from pneumorph.environment.crawling_task import CrawlingTask
from pneumorph.environment.place import Move, Place
from pneumorph.environment.reward import GOAL_TERMS, SAMPLE_STEPS, reward_terms
from pneumorph.environment.reward_term import ActionMotion
from pneumorph.robot.design import Design

_KEPT_ROBOTS = 10_000
"""Robots that are kept for when their design walks again: all of the paper's space, and of spaces
that nobody can list a share that does not grow with training."""


class CrawlingEnvironment(VectorEnv):
    """Robots that crawl side by side, each with its own design and its own episode.

    Observation of a robot: its most recent actions, newest first and zeros at the start, then its
    design in one-hot form (paper, appendix A): 12 + 32 numbers. The controller is open loop, so
    nothing of the robot's motion is observed. Action: one number in [-1, 1] for each regulator,
    held for `CrawlingTask.action_step_count` simulation steps. Reward: see `reward_terms`.

    Autoreset is ``AutoresetMode.SAME_STEP``: the step that ends a robot's episode returns the
    first observation of its next one (same design), and the last observation in
    ``info["final_obs"]``. The simulator itself is put back only when the next step asks for it,
    so a `reset` with new designs after the last action costs nothing twice.

    A robot whose simulation fails terminates at once, with its status in ``info["status"]`` and a
    finite reward; the others do not notice. All robots end together otherwise, as episodes have
    the same length.

    ``info`` of a step, all of shape (robot,): ``status``, ``distance_cm`` travelled since the
    robot's episode began, ``command_kPa`` (robot, regulator), ``forward_travel_cm`` and one entry
    for each reward term; where forward is not the goal ``achieved``, what of it was in its own
    unit, and ``mirrored_reward_cm``, what a robot's mirror image would get.
    For robots whose episode ended the same entries stand in ``info["final_info"]`` too.
    """

    metadata: dict[str, Any] = {  # noqa: RUF012 -- Gymnasium declares it as an instance variable
        "autoreset_mode": AutoresetMode.SAME_STEP,
        "render_modes": [],
    }

    def __init__(
        self,
        designs: Sequence[Design],
        build_robot: RobotBuilder,
        make_simulator: SimulatorFactory,
        task: CrawlingTask | None = None,
        module_count: int = 1,
        cavity_count: int = 1,
    ) -> None:
        """Build the robots and their simulator.

        Args:
            designs: One design per robot, all with the same number of locations.
            build_robot: Turns a design into a robot of the simulator.
            make_simulator: Makes the simulator of a list of robots.
            task: Actions, episode and pressures; None for the paper's.
            module_count: Kinds of modules that designs tell apart, see `Design.one_hot`.
            cavity_count: Most cavities of a module that have regulators of their own.

        Raises:
            ValueError: No design, or a design of another hub or with an unknown regulator.
        """
        if not designs:
            raise ValueError("designs is empty, expected one design per robot")
        self.task = task or CrawlingTask()
        self.num_envs = len(designs)
        self.location_count = designs[0].location_count
        self._features = (self.task.regulator_count, module_count, cavity_count)
        self._build_robot = build_robot
        self._robots: dict[Design, Any] = {}
        self._designs, self._one_hot = self._parsed(designs)
        self._simulator: CrawlingSimulator = make_simulator(
            [self._robot(design) for design in self._designs]
        )

        design_size = self._one_hot.shape[1]
        low = np.concatenate([-np.ones(self.task.state_size), np.zeros(design_size)])
        self.single_observation_space = gymnasium.spaces.Box(
            low.astype(np.float32), np.float32(1.0), dtype=np.float32
        )
        self.single_action_space = gymnasium.spaces.Box(
            np.float32(-1.0), np.float32(1.0), (self.task.regulator_count,), np.float32
        )
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)

        self._memory = np.zeros((self.num_envs, self.task.state_size), dtype=np.float32)
        self._heading_deg = np.full(self.num_envs, np.nan)
        self._action_number = np.zeros(self.num_envs, dtype=np.int64)
        self._distance_cm = np.zeros(self.num_envs)
        self._last_command_kPa = np.zeros((self.num_envs, self.task.regulator_count))
        self._awaits_reset = np.ones(self.num_envs, dtype=bool)
        self._was_reset = False
        self._motion: ActionMotion | None = None
        self._start = Place(*np.zeros((3, self.num_envs)))

    @property
    def is_symmetric(self) -> bool:
        """Whether a robot and its mirror image, doing the same, are rewarded alike."""
        return self.task.reward.is_symmetric

    @property
    def simulator(self) -> CrawlingSimulator:
        """What the robots are simulated by; after a step at the step's end, also of an episode."""
        return self._simulator

    @property
    def motion(self) -> ActionMotion:
        """What the robots did in the last step.

        Raises:
            ResetNeeded: There was none.
        """
        if self._motion is None:
            raise gymnasium.error.ResetNeeded("call reset and step before asking for the motion")
        return self._motion

    @property
    def designs(self) -> tuple[Design, ...]:
        """Design of each robot."""
        return self._designs

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start a new episode of every robot. A seed or designs that are refused leave all
        episodes as they are.

        Args:
            seed: Given to a simulator that draws its physics (`RedrawingSimulator`); the task
                itself draws no random numbers.
            options: ``{"designs": [...]}`` gives every robot a new design, or its text, else it
                keeps its own.

        Raises:
            TypeError: A design is neither that nor text.
            ValueError: An unknown option, or designs of the wrong number or kind.
            gymnasium.error.Error: A seed that is negative or no whole number.
        """
        unknown = set(options or {}) - {"designs"}
        if unknown:
            raise ValueError(
                f"reset option {sorted(unknown)[0]!r} is unknown, expected 'designs': the design "
                "of each robot"
            )
        # Before anything else changes, seed and designs may be refused.
        super().reset(seed=seed)
        if options and options.get("designs") is not None:
            designs, one_hot = self._parsed(options["designs"])
            self._simulator.set_robots([self._robot(design) for design in designs])
            self._designs, self._one_hot = designs, one_hot
        if seed is not None and isinstance(self._simulator, RedrawingSimulator):
            self._simulator.redraw(seed)
        self._begin(np.ones(self.num_envs, dtype=bool))
        self._was_reset = True
        return self._observation(), {}

    def step(
        self, actions: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Hold one action of every robot for `CrawlingTask.action_step_count` steps.

        Args:
            actions: shape (robot, regulator), each from -1 to 1.

        Returns:
            Observations (robot, observation), rewards [cm] (robot,), terminations (robot,),
            truncations (robot,), info.

        Raises:
            ValueError: An action has the wrong shape, is not finite or is out of range.
        """
        if not self._was_reset:
            raise gymnasium.error.ResetNeeded("call reset before the first step")
        actions = np.asarray(actions)
        if actions.shape != self.action_space.shape:
            raise ValueError(
                f"actions has shape {actions.shape}, expected (robot, regulator) = "
                f"{self.action_space.shape}"
            )
        command_kPa = self.task.pressure_kPa(actions)
        self._settle()

        before = self._place()
        samples, slides_mm = self._advance(command_kPa, before)
        status = np.array(self._simulator.status, dtype=np.uint8)
        failed = status != RUNNING
        span = self.task.maximum_pressure_kPa - self.task.minimum_pressure_kPa
        after = self._place()
        before, after = before.faced(after), after.faced(after)
        self._motion = ActionMotion.of(before, after, failed, self._start, self._simulator)
        moved = before.to(after)
        terms_of = partial(
            reward_terms,
            moved.forward_mm,
            failed,
            self.task.reward,
            pressure_change=np.abs(command_kPa - self._last_command_kPa).sum(axis=1) / span,
            **samples,
        )
        terms, told = self._terms(terms_of, moved, slides_mm)
        told |= reward_terms(moved.forward_mm, failed)  # whatever the goal is
        self._last_command_kPa = command_kPa
        reward = np.sum(list(terms.values()), axis=0)

        self._memory = np.concatenate(
            [actions.astype(np.float32), self._memory[:, : -self.task.regulator_count]], axis=1
        )
        self._action_number += 1
        self._distance_cm += told["forward_travel_cm"]
        time_is_up = self._action_number >= self.task.action_count
        terminated = failed | (time_is_up & self.task.time_limit_is_terminal)
        truncated = time_is_up & ~terminated

        info: dict[str, Any] = {
            "status": status,
            "distance_cm": self._distance_cm.copy(),
            "command_kPa": command_kPa,
            **terms,
            **told,
        }
        info |= {f"_{name}": np.ones(self.num_envs, dtype=bool) for name in tuple(info)}
        ended = terminated | truncated
        if ended.any():
            info |= self._final(ended, info)
            self._begin(ended)
        return self._observation(), reward, terminated, truncated, info

    def _advance(
        self, command_kPa: np.ndarray, place: Place
    ) -> tuple[dict[str, np.ndarray], np.ndarray]:
        """Hold an action; of what `reward_terms` takes, each (robot,), what the reward asks to be
        looked at within it: mean share of the weight on the hub, mean tilt beyond what is free; and
        the furthest slide back from the goal, of the robots and of their mirror images [mm],
        (2, robot)."""
        steps, weights = self.task.action_step_count, self.task.reward
        gone = np.zeros((2, self.num_envs))
        furthest, slide = gone, gone
        if not weights.needs_samples:
            self._simulator.advance(command_kPa, steps)
            return {}, slide
        means: dict[str, list[np.ndarray]] = {}
        for begin in range(0, steps, SAMPLE_STEPS):
            self._simulator.advance(command_kPa, min(SAMPLE_STEPS, steps - begin))
            if weights.backsliding > 0.0:
                last, place = place, self._place()
                moved = last.faced(place).to(place.faced(place))
                gone = gone + np.nan_to_num(
                    [each.towards(weights.direction) for each in (moved, moved.mirrored())]
                )
                furthest = np.maximum(furthest, gone)
                slide = np.maximum(slide, furthest - gone)
            if weights.hub_load > 0.0:
                means.setdefault("hub_load_share", []).append(self._loaded.hub_load_share)
            if weights.tilt > 0.0:
                beyond = np.maximum(self._leaning.tilt_deg - weights.free_tilt_deg, 0.0)
                means.setdefault("tilt_deg", []).append(beyond)
        return {name: np.mean(at, axis=0) for name, at in means.items()}, slide

    def _place(self) -> Place:
        """Where the robots are now; to the left and turned 0 where the simulator knows of none. One
        that is tipped over faces where it did: turning over is no turn. The heading of one that
        starts so is NaN until it first faces anywhere, see `Place.faced`."""
        forward_mm = np.array(self._simulator.forward_position_mm, dtype=np.float64)
        if not isinstance(self._simulator, TurningSimulator):
            if self.task.reward.goal != "forward":
                raise ValueError(
                    f"reward.goal is {self.task.reward.goal!r}, expected 'forward' for a simulator "
                    f"that does not know where its robots turn, {type(self._simulator).__name__}"
                )
            return Place(forward_mm, np.zeros(self.num_envs), np.zeros(self.num_envs))
        heading_deg = np.array(self._simulator.heading_deg, dtype=np.float64)
        self._heading_deg = np.where(np.isfinite(heading_deg), heading_deg, self._heading_deg)
        left_mm = np.array(self._simulator.left_position_mm, dtype=np.float64)
        return Place(forward_mm, left_mm, self._heading_deg)

    def _terms(
        self, terms_of: Callable[..., dict[str, np.ndarray]], moved: Move, slides_mm: np.ndarray
    ) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
        """Terms of the reward, and where forward is no goal what was achieved of it and what the
        robots' mirror images get."""
        goal = self.task.goal
        if goal.is_forward:
            return terms_of(slide_mm=slides_mm[0]), {}
        terms, image = (
            terms_of(left_mm=each.left_mm, turn_deg=each.turn_deg, slide_mm=slide_mm)
            for each, slide_mm in zip((moved, moved.mirrored()), slides_mm, strict=True)
        )
        mirrored = np.sum(list(image.values()), axis=0)
        own = np.sum(list(terms.values()), axis=0)
        told = {
            "mirrored_reward_cm": mirrored,
            "mirrored_with_cm": mirrored,
            "rewarded_cm": own,
        }
        told["achieved"] = terms[GOAL_TERMS[goal.name]] / goal.cm_per_unit
        return terms, told

    @property
    def _loaded(self) -> LoadedSimulator:
        if not isinstance(self._simulator, LoadedSimulator):
            raise ValueError(
                f"reward.hub_load is {self.task.reward.hub_load:g}, expected 0 for a simulator "
                f"that does not know what its robots stand on, {type(self._simulator).__name__}"
            )
        return self._simulator

    @property
    def _leaning(self) -> LeaningSimulator:
        if not isinstance(self._simulator, LeaningSimulator):
            raise ValueError(
                f"reward.tilt is {self.task.reward.tilt:g}, expected 0 for a simulator that does "
                f"not know how its robots lean, {type(self._simulator).__name__}"
            )
        return self._simulator

    def _final(self, ended: np.ndarray, info: dict[str, Any]) -> dict[str, Any]:
        """Last observation and info of ended episodes, in the layout of Gymnasium's own."""
        observation = self._observation()
        final_observation = np.full(self.num_envs, None, dtype=object)
        for robot in np.flatnonzero(ended):
            final_observation[robot] = observation[robot]
        final_info = {
            name: ended.copy() if name.startswith("_") else value for name, value in info.items()
        }
        return {
            "final_obs": final_observation,
            "_final_obs": ended.copy(),
            "final_info": final_info,
            "_final_info": ended.copy(),
        }

    def _begin(self, robots: np.ndarray) -> None:
        """Start a new episode of the robots marked in ``robots`` (robot,) bool."""
        self._memory = np.where(robots[:, None], np.float32(0.0), self._memory)
        self._action_number[robots] = 0
        self._distance_cm[robots] = 0.0
        self._heading_deg = np.where(robots, np.nan, self._heading_deg)
        self._last_command_kPa = np.where(robots[:, None], 0.0, self._last_command_kPa)
        self._awaits_reset |= robots

    def _settle(self) -> None:
        """Put back the robots that await it and let them fall on the floor at zero pressure, where
        their way begins."""
        waiting = self._awaits_reset
        if not waiting.any():
            return
        zero = np.zeros((self.num_envs, self.task.regulator_count))
        chosen = None if waiting.all() else waiting
        self._simulator.reset(active=chosen)
        self._simulator.advance(zero, self.task.settling_step_count, active=chosen)
        if isinstance(self._simulator, RangedSimulator):
            self._simulator.forget_range(chosen)
        self._start = self._start.unless(waiting, self._place())
        self._awaits_reset = np.zeros(self.num_envs, dtype=bool)

    def _observation(self) -> np.ndarray:
        return np.concatenate([self._memory, self._one_hot], axis=1)

    def _parsed(self, asked: Sequence[Design | str]) -> tuple[tuple[Design, ...], np.ndarray]:
        """The designs and their one-hot form, (robot, feature); refused where they do not fit."""
        if isinstance(asked, str):
            raise TypeError(f"designs is {asked!r:.60}, expected one for each robot, in a list")
        designs = tuple(map(Design.parse, asked))
        if len(designs) != self.num_envs:
            raise ValueError(
                f"got {len(designs)} designs, expected {self.num_envs}: one per robot of the batch"
            )
        for design in designs:
            if design.location_count != self.location_count:
                raise ValueError(
                    f"design {design} has {design.location_count} locations, expected "
                    f"{self.location_count} as the other robots have"
                )
        return designs, np.stack([design.one_hot(*self._features) for design in designs])

    def _robot(self, design: Design) -> Any:
        if design not in self._robots:
            if len(self._robots) >= _KEPT_ROBOTS:
                self._robots.clear()
            self._robots[design] = self._build_robot(design)
        return self._robots[design]
