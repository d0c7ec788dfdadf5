"""Meshes that several tests share, and a browser for the pages that the package writes."""

from __future__ import annotations

import math
import os
import shutil
import tempfile
import time
from collections.abc import Callable, Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import pytest
from jaxtyping import install_import_hook

# Before anything imports them: arrays of these files have the axes that their annotations name.
# Meshes and reduced parts refuse others themselves, with messages of their own, and states are made
# at every step: test_array_axes holds what they accept, and the engine's states, to theirs.
AXES_ARE_CHECKED_IN = (
    "pneumorph.trajectory",
    "pneumorph.simulation.reference_step",
    "pneumorph.simulation.reference_mass",
    "pneumorph.simulation.reference_forces",
    "pneumorph.simulation.reference_contact",
)
if find_spec("beartype"):
    install_import_hook(AXES_ARE_CHECKED_IN, "beartype.beartype")

from pneumorph.geometry.mesh import Mesh  # noqa: E402

# Learners compiled once serve pytest's workers and every process that tests start: compiling is
# most of a short run. Workers inherit the environment of the process that began them.
if "JAX_COMPILATION_CACHE_DIR" not in os.environ:
    _COMPILED = tempfile.TemporaryDirectory(prefix="compiled-")
    os.environ["JAX_COMPILATION_CACHE_DIR"] = _COMPILED.name
    os.environ["JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS"] = "0"
# Neither Ray nor Weights & Biases tells anyone about tests.
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
os.environ["WANDB_ERROR_REPORTING"] = "false"

# What draws without a graphics card: SwiftShader, on the processor, for WebGL alone.
_SOFTWARE_GRAPHICS = [
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",
    "--no-sandbox",
]
# A loaded machine without a graphics card is slow; nothing here should fail for that.
_PATIENCE_MS = 180_000

# Files that take half a minute and more on a slow machine, the longest first.
_LONG = (
    "command/test_report_pages.py",
    "reproduce/test_experiments.py",
    "test_processors.py",
    "test_tutorials.py",
    "command/test_experiment_verbs.py",
    "command/test_damaged_files.py",
    "command/test_fuzz.py",
    "command/test_certify_verb.py",
    "hardware/test_virtual_rig.py",
    "simulation/test_shared_simulator.py",
    "examples/test_own_task.py",
    "command/test_viewing_verbs.py",
    "base/test_executor.py",
    "fabrication/test_hub.py",
    "hardware/test_fault_list.py",
    "command/test_certified_rounds.py",
    "reproduce/test_robust.py",
    "command/test_verbs.py",
    "test_examples.py",
)
_PLACE = {Path(__file__).parent / name: number for number, name in enumerate(_LONG)}
# Where it is set, such as by CI, no test begins after it [seconds since 1970], and those of these
# files come last: a machine of a third of the usual speed has no time for them.
_UNTIL_S = float(os.environ.get("PNEUMORPH_TESTS_UNTIL_S", "inf"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with the longest files, so that no worker waits at the end for another's; end with them
    where there may be no time left for them."""
    others = -1 if math.isfinite(_UNTIL_S) else len(_PLACE)
    items.sort(key=lambda item: _PLACE.get(item.path, others))


@pytest.hookimpl(tryfirst=True)  # before what the test is given is made
def pytest_runtest_setup() -> None:
    """Leave out a test that would begin too late."""
    if time.time() > _UNTIL_S:
        pytest.skip("no time left (PNEUMORPH_TESTS_UNTIL_S)")


@pytest.fixture(scope="session")
def leg_mesh() -> Mesh:
    pytest.importorskip("netgen")
    from pneumorph.geometry.pneunet import mesh_pneunet

    return mesh_pneunet()


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """A headless Chromium, the system's or Playwright's own; tests are skipped without one."""
    api = pytest.importorskip("playwright.sync_api")
    names = ("chromium", "chromium-browser", "google-chrome")
    found = next((path for path in map(shutil.which, names) if path), None)
    with api.sync_playwright() as playwright:
        try:
            browser = playwright.chromium.launch(executable_path=found, args=_SOFTWARE_GRAPHICS)
        except api.Error as error:
            # A browser is no Python package, so not every machine can install it; CI does.
            pytest.skip(f"no Chromium (apt install chromium): {str(error).splitlines()[0]}")
        yield browser
        browser.close()


@pytest.fixture
def open_page(chromium: Any) -> Iterator[Callable[[Path | str], Any]]:
    """Return a function that opens a file with the network off, or an address of this machine.

    At the end no page may have had an error on its console, or asked for anything but itself.
    """
    problems: list[str] = []
    contexts = []

    def watch_request(request: Any) -> None:
        parts = urlsplit(request.url)
        local = parts.hostname in ("127.0.0.1", "localhost")
        if parts.scheme not in ("file", "data", "blob") and not local:
            problems.append(f"request of {request.url}")

    def note(message: Any) -> None:
        if message.type == "error":
            problems.append(message.text)

    def open_one(target: Path | str) -> Any:
        is_file = isinstance(target, Path)
        context = chromium.new_context(
            offline=is_file, viewport={"width": 800, "height": 600}, service_workers="block"
        )
        contexts.append(context)
        context.set_default_timeout(_PATIENCE_MS)
        page = context.new_page()
        page.on("console", note)
        page.on("pageerror", lambda error: problems.append(str(error)))
        page.on("request", watch_request)
        page.goto(target.resolve().as_uri() if is_file else target)
        return page

    yield open_one
    for context in contexts:
        context.close()
    assert problems == []
