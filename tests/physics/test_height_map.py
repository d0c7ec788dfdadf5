"""Floors read from images and arrays."""

import numpy as np
import pytest
from helpers.height_field import height_field

from pneumorph.base.settings import settings_from_dict, settings_to_dict
from pneumorph.physics.floor import PlaneFloor
from pneumorph.physics.ground import Ground
from pneumorph.physics.height_map import HeightMap


def cubic(x, y):
    return 1e-3 * x**3 - 2e-3 * x * y**2 + 0.05 * y + 2.0


def grid(columns=21, rows=15, pitch=2.0):
    """Pixel centres as seen from above: x to the right, y upwards."""
    x = pitch * (np.arange(columns) - (columns - 1) / 2)
    y = pitch * ((rows - 1) / 2 - np.arange(rows))
    return np.meshgrid(x, y)


def test_bicubic_splines_follow_a_cubic_exactly():
    field = height_field(cubic(*grid()), 2.0, base_mm=-1.0)
    rng = np.random.default_rng(0)
    points = np.column_stack([rng.uniform(-19, 19, 30), rng.uniform(-13, 13, 30), np.zeros(30)])
    x, y, _ = points.T
    slopes = np.stack([3e-3 * x**2 - 2e-3 * y**2, -4e-3 * x * y + 0.05])
    length = np.sqrt(1.0 + (slopes**2).sum(axis=0))
    # Rounding of heights of 10 mm; splines of degree three have no other error.
    np.testing.assert_allclose(field.gap(points), (1.0 - cubic(x, y)) / length, atol=1e-12)
    expected = np.stack([-slopes[0], -slopes[1], np.ones(30)]) / length
    np.testing.assert_allclose(field.frames(points)[:, 0], expected.T, atol=1e-12)


def test_columns_go_along_x_and_rows_down_from_positive_y():
    heights = np.zeros((9, 11))
    heights[1, 8] = 5.0
    field = height_field(heights, 10.0, centre_mm=(100.0, 0.0))
    peak = np.array([[100.0 + 3 * 10.0, 3 * 10.0, 5.0]])
    assert abs(field.gap(peak)[0]) < 1e-12


def test_beyond_its_edge_the_floor_goes_on_level():
    field = height_field(np.tile(np.arange(6.0), (5, 1)), 1.0)
    outside = np.array([[40.0, 0.0, 5.0], [-40.0, 90.0, 0.0]])
    np.testing.assert_allclose(field.gap(outside), 0.0, atol=1e-12)
    np.testing.assert_allclose(field.frames(outside), PlaneFloor(0.0).frames(outside), atol=1e-12)


@pytest.mark.parametrize(("kind", "levels"), [("uint8", 255), ("uint16", 65535)])
def test_greys_of_an_image_are_heights(tmp_path, kind, levels):
    from PIL import Image

    greys = np.linspace(0, levels, 8 * 9).round().astype(kind).reshape(8, 9)
    Image.fromarray(greys).save(tmp_path / "hills.png")
    heights = HeightMap(tmp_path / "hills.png", black_mm=-2.0, white_mm=6.0).heights_mm()
    # Images are read in single precision.
    np.testing.assert_allclose(heights, -2.0 + 8.0 * greys / levels, atol=1e-6)


def test_a_grey_image_with_three_equal_colours_is_grey(tmp_path):
    from matplotlib.image import imsave

    greys = np.linspace(0.0, 1.0, 30).reshape(5, 6)
    imsave(tmp_path / "hills.png", greys, cmap="gray", vmin=0.0, vmax=1.0)
    heights = HeightMap(tmp_path / "hills.png", white_mm=1.0).heights_mm()
    # Written with 256 colours of 256 levels.
    np.testing.assert_allclose(heights, greys, atol=2.0 / 255)


RAMP = np.linspace(0.0, 1.0, 8 * 9).reshape(8, 9)


def saved(folder, name, pixels, **options):
    """The path of an image of these pixels."""
    from PIL import Image

    Image.fromarray(pixels).save(folder / name, **options)
    return folder / name


@pytest.mark.parametrize("name", ["hills.tif", "hills.pgm", "hills.png"])
def test_sixteen_bits_of_any_format_are_heights(tmp_path, name):
    greys = (65535 * RAMP).round().astype("uint16")
    heights = HeightMap(saved(tmp_path, name, greys), white_mm=20.0).heights_mm()
    np.testing.assert_allclose(heights, 20.0 * greys / 65535, atol=1e-5)


@pytest.mark.parametrize("mode", ["LA", "P", "1"])
def test_greys_with_alpha_of_a_palette_or_of_one_bit_are_heights(tmp_path, mode):
    from PIL import Image

    greys = (255 * (RAMP > 0.4 if mode == "1" else RAMP)).astype("uint8")
    Image.fromarray(greys).convert(mode).save(tmp_path / "hills.png")
    heights = HeightMap(tmp_path / "hills.png", white_mm=20.0).heights_mm()
    np.testing.assert_allclose(heights, 20.0 * greys / 255.0, atol=1e-5)


@pytest.mark.parametrize(
    ("name", "pixels", "message"),
    [
        ("hills.tif", (20.0 * RAMP).astype("float32"), r"mode F \(floating-point numbers\)"),
        ("hills.pfm", (20.0 * RAMP).astype("float32"), r"mode F \(floating-point numbers\)"),
        ("hills.tif", (65535 * RAMP).astype("int32"), r"mode I \(integers that are signed or of"),
    ],
)
def test_images_without_a_white_are_refused(tmp_path, name, pixels, message):
    """Matplotlib cuts theirs above 255, so that hills of 20 mm had 0.8."""
    path = saved(tmp_path, name, pixels)
    with pytest.raises(ValueError, match=message + r".* 8 or 16 bits, .* in mm saved as \.npy"):
        HeightMap(path, white_mm=20.0).heights_mm()


def test_a_tiff_whose_zero_is_white_is_refused(tmp_path):
    """Pillow turns such of 8 bits over and leaves those of 16 as they are."""
    greys = (65535 * RAMP).round().astype("uint16")
    path = saved(tmp_path, "hills.tif", greys, tiffinfo={262: 0})
    with pytest.raises(ValueError, match=r"hills\.tif is a TIFF of 16 bits whose 0 is white"):
        HeightMap(path).heights_mm()


def test_settings_name_the_map(tmp_path):
    np.save(tmp_path / "hills.npy", cubic(*grid()))
    map_of_hills = HeightMap(tmp_path / "hills.npy", mm_per_pixel=2.0)
    again = settings_from_dict(HeightMap, settings_to_dict(map_of_hills))
    assert again == map_of_hills
    point = np.array([[4.0, 2.0, -1.0 + cubic(4.0, 2.0)]])
    floor = Ground(again).floor(-1.0, point)
    assert abs(floor.gap(point)[0]) < 1e-12
    assert floor.description == "height map hills.npy"
    assert Ground().floor(-12.797, point) == PlaneFloor(-12.797)


def test_smoothing_rounds_a_step():
    step = np.repeat([[0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]], 6, axis=0)
    points = np.array([[-0.4, 0.0, 0.0], [0.4, 0.0, 0.0]])
    steep, smooth = (height_field(step, 1.0, smoothing_mm=s).frames(points)[0] for s in (0.0, 1.5))
    slope_steep, slope_smooth = -steep[0, 0] / steep[0, 2], -smooth[0, 0] / smooth[0, 2]
    # A Gaussian of standard deviation s makes the slope of a unit step 1 / (s sqrt(2 pi)) = 0.27.
    assert slope_steep > 0.7
    assert 0.2 < slope_smooth < 0.3


def test_bad_maps_are_refused(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"height map .*none\.png does not exist"):
        HeightMap(tmp_path / "none.png").heights_mm()
    (tmp_path / "text.png").write_text("hills")
    with pytest.raises(ValueError, match="is not an image that can be read"):
        HeightMap(tmp_path / "text.png").heights_mm()
    from matplotlib.image import imsave

    imsave(tmp_path / "red.png", np.tile([1.0, 0.0, 0.0], (5, 5, 1)))
    with pytest.raises(ValueError, match="has colours, expected greys"):
        HeightMap(tmp_path / "red.png").heights_mm()
    with pytest.raises(ValueError, match=r"at least 4 each, .* got the shape \(3, 5\)"):
        height_field(np.zeros((3, 5)), 1.0)
    hole = np.zeros((5, 6))
    hole[2, 4] = np.nan
    with pytest.raises(ValueError, match=r"got nan in row 2, column 4 \(1 of 30 are not\)"):
        height_field(hole, 1.0)
    np.save(tmp_path / "metres.npy", 0.02e-3 * np.arange(30.0).reshape(5, 6))
    with pytest.raises(ValueError, match=r"differ by 0\.00058 mm, expected .* be in metres"):
        HeightMap(tmp_path / "metres.npy").smoothed_mm()
    np.save(tmp_path / "level.npy", np.full((5, 6), 3.0))
    np.testing.assert_allclose(HeightMap(tmp_path / "level.npy").smoothed_mm(), 3.0)
    with pytest.raises(ValueError, match="mm_per_pixel must be positive, got 0"):
        HeightMap(tmp_path / "red.png", mm_per_pixel=0.0)
