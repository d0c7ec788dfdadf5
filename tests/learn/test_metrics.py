"""Metrics are lines of JSON that a resumed run continues."""

import json
import struct
import subprocess
import sys
import textwrap
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pneumorph.base.artefact import ArtefactError
from pneumorph.learn.metrics import (
    DRAWN,
    METRICS_FILE,
    TENSORBOARD_FOLDER,
    MetricsLog,
    read_metrics,
    score_histogram,
)


def test_resumed_log_forgets_what_came_after_the_checkpoint(tmp_path: Path) -> None:
    log = MetricsLog(tmp_path)
    for timestep in (10, 20, 30):
        log.write({"timestep": timestep, "return_mean_cm": 0.1, "score_histogram": [1.0]})
    log.close()
    with (tmp_path / METRICS_FILE).open("a") as stream:
        stream.write('{"timestep": 40, "ret')  # what a kill leaves
    log = MetricsLog(tmp_path, timestep=20)
    log.write({"timestep": 30, "return_mean_cm": 0.2})
    log.close()
    lines = read_metrics(tmp_path)
    assert [(line["timestep"], line["return_mean_cm"]) for line in lines] == [
        (10, 0.1),
        (20, 0.1),
        (30, 0.2),
    ]


def test_tensorboard_reads_the_same_numbers(tmp_path: Path) -> None:
    log = MetricsLog(tmp_path)
    for timestep, distance in ((10, 0.25), (20, 1.5)):
        log.write({"timestep": timestep, "best_distance_cm": distance, "score_histogram": [1.0]})
    log.close()
    scalars = [
        (event.step, value.tag, value.simple_value)
        for event in _events(tmp_path / TENSORBOARD_FOLDER)
        for value in event.summary.value
    ]
    # Both are powers of two, exact in TensorBoard's single precision.
    assert scalars == [(10, "best_distance_cm", 0.25), (20, "best_distance_cm", 1.5)]


def test_tensorboard_forgets_a_training_that_began_anew(tmp_path: Path) -> None:
    """As the lines do; one that goes on keeps its file beside a new one."""
    board = tmp_path / TENSORBOARD_FOLDER
    for number, timestep in enumerate((0, 0, 20)):
        log = MetricsLog(tmp_path, timestep)
        for later in (10, 20):
            log.write({"timestep": timestep + later, "return_mean_cm": 0.5})
        log.close()
        (new,) = board.glob("events.out.tfevents.*")
        new.rename(board / f"kept.{number}")  # the next may be of the same second, by its name
    assert sorted(file.name for file in board.iterdir()) == ["kept.1", "kept.2"]
    assert [line["timestep"] for line in read_metrics(tmp_path)] == [10, 20, 30, 40]


def _events(folder: Path) -> list[Any]:
    """Events of a TensorBoard folder: records of length, its checksum, event, its checksum."""
    from tensorboardX.proto.event_pb2 import Event

    (file,) = folder.glob("events.out.tfevents.*")
    content, place, events = file.read_bytes(), 0, []
    while place < len(content):
        (size,) = struct.unpack_from("<Q", content, place)
        events.append(Event.FromString(content[place + 12 : place + 12 + size]))
        place += size + 16
    return events


def test_metrics_that_are_not_finite_are_refused(tmp_path: Path) -> None:
    log = MetricsLog(tmp_path)
    with pytest.raises(ValueError, match="not JSON compliant"):
        log.write({"timestep": 1, "critic_loss": float("nan")})
    log.close()


def test_what_is_drawn_may_lack_no_number_but_the_best_distance(tmp_path: Path) -> None:
    """No robot need have come to the end of its walk; what no figure draws may be anything."""
    line: dict[str, Any] = {**dict.fromkeys(DRAWN, 1.0), "timestep": 10, "note": None}
    line["score_histogram"] = [1.0]
    path = tmp_path / METRICS_FILE
    path.write_text(json.dumps({**line, "best_distance_cm": None}) + "\n")
    assert read_metrics(tmp_path, DRAWN)[0]["best_distance_cm"] is None
    path.write_text(json.dumps({**line, "return_mean_cm": None}) + "\n")
    with pytest.raises(ArtefactError, match="return_mean_cm: expected a finite number, got None"):
        read_metrics(tmp_path, DRAWN)


def test_histogram_holds_all_probability() -> None:
    scores = np.array([-99.0, 0.1, 0.2, 99.0])
    shares = score_histogram(scores, np.array([0.1, 0.2, 0.3, 0.4]))
    np.testing.assert_allclose(sum(shares), 1.0)
    np.testing.assert_allclose([shares[0], shares[10], shares[-1]], [0.1, 0.5, 0.4])


def test_a_full_disk_is_told_with_what_cannot_be_written(tmp_path: Path) -> None:
    """Here files of more than 64 kB, which TensorBoard's is first; whoever writes is not kept
    waiting."""
    program = textwrap.dedent(f"""
        import resource
        from pneumorph.learn.metrics import MetricsLog

        log = MetricsLog({str(tmp_path)!r})
        resource.setrlimit(resource.RLIMIT_FSIZE, (2**16, 2**16))
        try:
            for timestep in range(1, 1000):
                log.write({{"timestep": timestep, **{{f"number_{{n}}": n for n in range(25)}}}})
        except OSError as error:
            print(error)
    """)
    told = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=60.0
    )
    assert f"File too large: '{tmp_path / TENSORBOARD_FOLDER}'" in told.stdout


def test_a_full_disk_closes_what_is_open_and_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = MetricsLog(tmp_path)
    log._file.close()
    log._file = open("/dev/full", "w")  # noqa: SIM115
    with pytest.raises(OSError, match=f"No space left on device: '{tmp_path / METRICS_FILE}'"):
        log.write({"timestep": 1})
    with pytest.raises(OSError, match=f"No space left on device: '{tmp_path / METRICS_FILE}'"):
        log.close()
    assert log._file.closed
    assert _events(tmp_path / TENSORBOARD_FOLDER)[0].file_version == "brain.Event:2"
