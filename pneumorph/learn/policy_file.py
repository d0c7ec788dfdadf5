"""A trained policy as a file of plain arrays that numpy alone can read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from pneumorph.base.artefact import ArtefactError, load_artefact, reading, save_artefact
from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.learn.networks import Policy
from pneumorph.learn.settings import CooptSettings

KIND = "Policy"
VERSION = 1


def save_policy(path: Path | str, policy: Policy, settings: CooptSettings, **metadata: Any) -> Path:
    """Write a policy with the settings it was trained with.

    ``layer_0_weight`` (output, input), ``layer_0_bias`` (output,) and so on; rectifiers between
    the layers; the last layer gives the means, then the log standard deviations, before tanh.
    """
    arrays = {}
    for number, layer in enumerate(policy.network.layers):
        arrays[f"layer_{number}_weight"] = np.asarray(layer.weight)
        arrays[f"layer_{number}_bias"] = np.asarray(layer.bias)
    return save_artefact(
        path,
        KIND,
        VERSION,
        arrays,
        {
            **metadata,
            "observation_size": policy.observation_size,
            "settings": settings_to_dict(settings),
        },
    )


def load_policy(path: Path | str) -> tuple[Policy, CooptSettings, dict[str, Any]]:
    """Read a policy, its settings, and all metadata.

    Raises:
        FileNotFoundError: No such file.
        ArtefactError: Not a policy, of another version, or with layers that do not fit.
    """
    arrays, metadata = load_artefact(path, KIND, VERSION)
    with reading(path, KIND):
        settings = settings_from_dict(CooptSettings, metadata["settings"])
        # Earlier versions knew no environments but those of the settings.
        usual = settings.task.state_size + settings.space.feature_count
        observation_size = int(metadata.get("observation_size", usual))
    policy = Policy(
        observation_size,
        settings.task.regulator_count,
        settings.sac.hidden_sizes,
        jax.random.PRNGKey(0),
        settings.sac.log_standard_deviation_range,
    )
    leaves: list[Any] = []
    for number, layer in enumerate(policy.network.layers):
        for name, expected in (("weight", layer.weight), ("bias", layer.bias)):
            value = arrays.get(f"layer_{number}_{name}")
            if value is None or expected is None or value.shape != expected.shape:
                raise ArtefactError(
                    f"{path} has layer_{number}_{name} of shape "
                    f"{None if value is None else value.shape}, expected "
                    f"{None if expected is None else expected.shape} from its settings"
                )
            leaves.append(jnp.asarray(value))

    def where(policy: Policy) -> list[Any]:
        return [part for layer in policy.network.layers for part in (layer.weight, layer.bias)]

    return eqx.tree_at(where, policy, leaves), settings, metadata
