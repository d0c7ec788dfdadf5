"""The regions of a mesh, seen at a slant and from below."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneumorph.report.style import (
    DISK_COLOUR,
    INK_COLOUR,
    REGULATOR_COLOURS,
    figure_style,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pneumorph.geometry.mesh import Mesh

_VIEWS = ((24.0, -62.0), (-28.0, -62.0))


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
    named = dict(zip(mesh.surfaces, REGULATOR_COLOURS, strict=False))
    for place, (elevation, azimuth) in enumerate(_VIEWS, start=1):
        axes = figure.add_subplot(1, 2, place, projection="3d", computed_zorder=False)
        axes.plot_trisurf(x, y, z, triangles=outside, color=DISK_COLOUR, edgecolor="#B8BDC2",
                          linewidth=0.15, alpha=0.35, shade=False, rasterized=True)  # fmt: skip
        for faces, colour in zip(mesh.surfaces.values(), REGULATOR_COLOURS, strict=False):
            axes.plot_trisurf(x, y, z, triangles=faces[:, :3], color=colour, alpha=0.7,
                              edgecolor="none", shade=False, rasterized=True)  # fmt: skip
        for nodes in mesh.node_sets.values():
            axes.plot(*mesh.nodes[nodes].T, ".", color=INK_COLOUR, markersize=2.5)
        low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        axes.set_box_aspect(np.maximum(high - low, 1e-9), zoom=1.6)
        axes.view_init(elevation, azimuth)
        axes.axis("off")
    keys = [Patch(color=colour, label=name) for name, colour in named.items()]
    sets = ", ".join(mesh.node_sets)
    figure.legend(handles=keys, loc="outside lower center", ncols=max(1, len(keys)), fontsize=7,
                  title=f"dots: {sets}" if sets else None, title_fontsize=7)  # fmt: skip
    return figure
