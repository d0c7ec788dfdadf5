"""A robot shown in the browser while it is being simulated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pneumorph.base.checked import Bounds, Checked, NotNegative
from pneumorph.environment.goal import FORWARD, Goal
from pneumorph.report.replay.live_server import LivePage
from pneumorph.report.replay.page import page_of, player_script
from pneumorph.report.replay.replay_data import live_data, live_frame
from pneumorph.report.scene import Actor
from pneumorph.trajectory import Trajectory


@dataclass(frozen=True)
class LiveSettings(Checked):
    """The page that --live serves while the robot is simulated."""

    port: Annotated[int, Bounds(0, 65535)] = 0
    """Port on 127.0.0.1; 0 takes a free one."""
    linger_s: NotNegative = 120.0
    """How long the page can still be opened after the simulation has ended [s]. Serving ends sooner
    once a browser has all frames."""


class LiveReplay:
    """Serves a page of one robot; call it with every piece of its motion.

    Args:
        label: What to write beside the robot.
        settings: Port, and patience at the end.
        goal: What of its way is told.

    Raises:
        OSError: The port is taken.
    """

    def __init__(
        self, label: str, settings: LiveSettings | None = None, goal: Goal = FORWARD
    ) -> None:
        self._label, self._goal = label, goal
        self._settings = settings or LiveSettings()
        self._page = LivePage(
            page_of(label, f"<div></div><script>\n{player_script('live.js')}</script>"),
            self._settings.port,
        )
        self._sent_s = -1.0

    @property
    def address(self) -> str:
        """Where a browser finds the page."""
        return self._page.address

    def __call__(self, piece: Trajectory) -> None:
        """Show the frames of a piece; those at times that were shown already are left out.

        Args:
            piece: Some frames with nodes and skin, times since the start of the whole motion.
        """
        actor = Actor.of(piece, self._label, self._goal)
        for frame, time_s in enumerate(piece.time_s):
            if time_s <= self._sent_s + 1e-9:
                continue
            first = self._sent_s < 0.0
            content = live_data(actor, frame) if first else live_frame(actor, frame)
            self._page.send("start" if first else "frame", content)
            self._sent_s = float(time_s)

    def finish(self) -> bool:
        """Say that this was all, and wait until a page has got it or the keyboard ends the wait;
        return whether one has."""
        self._page.send("end", {})
        try:
            return self._page.wait_until_read(self._settings.linger_s)
        except KeyboardInterrupt:
            return False

    def __enter__(self) -> LiveReplay:
        return self

    def __exit__(self, *_: object) -> None:
        self._page.close()
