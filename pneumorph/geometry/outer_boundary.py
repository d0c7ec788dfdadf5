"""What a part shows to the outside."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry.mesh import Mesh
from pneumorph.geometry.region_names import cavity_regions
from pneumorph.geometry.surface import boundary_triangles


def outer_boundary(mesh: Mesh) -> np.ndarray:
    """Triangles of a mesh's boundary without those of its cavities, looking outwards,
    (triangle, 3): the closed surface of a part with all that it encloses.

    Args:
        mesh: The part.
    """
    boundary = boundary_triangles(mesh.tetrahedra)
    cavities = [mesh.surfaces[name].tolist() for name in cavity_regions(mesh)]
    inside = {tuple(sorted(each)) for triangles in cavities for each in triangles}
    outside = [tuple(sorted(each)) not in inside for each in boundary.tolist()]
    return boundary[outside]
