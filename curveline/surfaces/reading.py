"""A surface from a file, by its suffix: a mesh, or a grey picture; or from a formula."""

from __future__ import annotations

from collections.abc import Mapping
from os import fspath
from pathlib import PurePath

from curveline.drawings.reading import require_package
from curveline.errors import InvalidInput
from curveline.surfaces.height_field import FormulaField, HeightField
from curveline.surfaces.how_to_read import HowToReadSurface
from curveline.system.files import AnyPath, read_file, refuse_file

MAX_BYTES = 256_000_000
MESHES: Mapping[str, str] = {".stl": "stl", ".obj": "obj", ".ply": "ply"}
PICTURES = (".png", ".jpg", ".jpeg")
INSTEAD: Mapping[str, str] = {
    **dict.fromkeys((".step", ".stp", ".iges", ".igs", ".3dm", ".f3d", ".sldprt", ".blend"), "export it as STL"),
    **dict.fromkeys((".3mf", ".gltf", ".glb", ".dae", ".fbx", ".off", ".amf"), "export it as STL, OBJ or PLY"),
    **dict.fromkeys((".tif", ".tiff", ".bmp", ".gif", ".webp", ".exr", ".asc", ".dem"), "save it as a grey PNG"),
}
"""What to do with files that people try."""


def read_surface(path: AnyPath, how: HowToReadSurface | None = None) -> HeightField:
    """The surface in a file: a mesh (STL, OBJ, PLY) as it is seen from above, or a picture whose greys are heights.

    InvalidInput for a file that cannot be read, or whose scale nobody says; MissingExtra where a package is missing.
    """
    name, how = fspath(path), how or HowToReadSurface()
    suffix = PurePath(name).suffix.lower()
    if suffix not in (*MESHES, *PICTURES):
        known = ", ".join((*MESHES, *PICTURES))
        message = f"surfaces are not read from {suffix} files" if suffix else "the name of this file has no suffix"
        refuse_file(name, "kind", message, INSTEAD.get(suffix, f"name one that ends in {known}"))
    if suffix in MESHES and how.height_mm is not None:
        raise InvalidInput("--height-mm is for pictures", "a mesh has heights of its own: leave it out")
    data = read_file(path, MAX_BYTES)
    if not data.strip():
        refuse_file(name, "empty", "this file is empty", "save the surface again")
    if suffix in MESHES:
        from curveline.surfaces import meshes

        return meshes.read(data, MESHES[suffix], how, name)
    from curveline.surfaces import grey_pictures

    require_package("PNG")
    return grey_pictures.read(data, how, name)


def surface_of_formula(text: str) -> HeightField:
    """The height [mm] that a formula gives at x [mm] from the first rail on and y [mm] from the first line on.

    InvalidInput for what is no formula of x and y.
    """
    return FormulaField(text)
