"""The regions of a mesh, seen at a slant and from below."""

from __future__ import annotations

from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import (
    DISK_COLOUR,
    INK_COLOUR,
    figure_style,
    new_figure,
    region_colours,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.geometry.mesh import Mesh

_VIEWS = ((24.0, -62.0), (-28.0, -62.0))
_MARKERS = ("o", "^", "s", "D", "v", "P")
_ZOOM = 0.95
"""What lets a leg's both ends be seen."""


@figure_style()
def mesh_figure(mesh: Mesh) -> Figure:
    """Return the boundary pale with each named surface and node set in a colour of its own.

    Args:
        mesh: The mesh; lengths in mm.
    """
    from matplotlib.patches import Patch

    from pneumorph.geometry.surface import boundary_triangles

    x, y, z = mesh.nodes.T
    figure = new_figure(7.0, 2.9)
    outside = boundary_triangles(mesh.tetrahedra[:, :4])
    # The skin is what stands pale around the others.
    shown = {name: faces for name, faces in mesh.surfaces.items() if name != "skin"}
    named = dict(zip(shown, region_colours(len(shown)), strict=True))
    sets = {name: nodes for name, nodes in mesh.node_sets.items() if name not in mesh.surfaces}
    for place, (elevation, azimuth) in enumerate(_VIEWS, start=1):
        axes = figure.add_subplot(1, 2, place, projection="3d", computed_zorder=False)
        axes.plot_trisurf(x, y, z, triangles=outside, color=DISK_COLOUR, edgecolor="#B8BDC2",
                          linewidth=0.15, alpha=0.35, shade=False, rasterized=True)  # fmt: skip
        for name, faces in shown.items():
            axes.plot_trisurf(x, y, z, triangles=faces[:, :3], color=named[name], alpha=0.7,
                              edgecolor="none", shade=False, rasterized=True)  # fmt: skip
        for (name, nodes), marker in zip(sets.items(), cycle(_MARKERS), strict=False):
            axes.plot(*mesh.nodes[nodes].T, marker, color=INK_COLOUR, markersize=2.5, label=name)
        low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(np.maximum(high - low, 1e-9), zoom=_ZOOM)
        axes.view_init(elevation, azimuth)
        axes.axis("off")
    keys = [Patch(color=colour, label=name) for name, colour in named.items()]
    keys += axes.get_legend_handles_labels()[0]
    figure.legend(handles=keys, loc="outside lower center", ncols=max(1, min(len(keys), 6)),
                  fontsize=7)  # fmt: skip
    return figure
