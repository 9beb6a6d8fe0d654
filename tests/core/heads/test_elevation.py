import numpy as np
import pytest
from built import cloud_of, network_of
from rail_extract.core.heads.elevation import ElevationParameters, elevate, find_gaps, flat_rails
from rail_extract.core.heads.head_points import near_lines
from rail_extract.core.lines.network import LineNetwork
from scipy.ndimage import gaussian_filter1d

WIDTH = 0.072
PARAMETERS = ElevationParameters()


def elevated(network, points, parameters=PARAMETERS):
    return elevate(network, near_lines(network.lines, points, WIDTH), points.class_code, parameters)


def straight_line(length, step=0.1):
    x = np.arange(0, length + step / 2, step)
    return np.column_stack([x, np.zeros_like(x)])


def head(length, density, noise=0.003, low_share=0.1, slope=0.0, profile=lambda x: 0 * x, low_m=0.035, seed=0):
    """Points of a head along the x axis: a crown of 300 mm radius, and a share of points low on its left side face."""
    random = np.random.default_rng(seed)
    count = int(length * density)
    x, across = random.uniform(0, length, count), random.uniform(-WIDTH / 2, WIDTH / 2, count)
    down = across**2 / 0.6
    low = random.random(count) < low_share
    across[low], down[low] = WIDTH / 2, random.uniform(0, low_m, low.sum())
    xyz = np.column_stack([x, across, profile(x) + slope * across - down])
    return xyz + random.normal(0, noise, xyz.shape)


def height_error(rail, profile=lambda x: 0 * x):
    """Bias and rms of a rail's height, every 0.1 m."""
    x = np.arange(rail.xyz[0, 0], rail.xyz[-1, 0], 0.1)
    error = np.interp(x, rail.xyz[:, 0], rail.xyz[:, 2]) - profile(x)
    return error.mean(), np.sqrt(np.mean(error**2))


@pytest.mark.parametrize(
    ("noise", "low_share", "bias_limit", "rms_limit"),
    [
        (0.0, 0.1, 0.0006, 0.001),
        (0.003, 0.1, 0.0006, 0.001),
        (0.005, 0.1, 0.0008, 0.0015),
        (0.01, 0.1, 0.0015, 0.0025),
        (0.003, 0.4, 0.0012, 0.0015),
    ],
)
def test_height_is_that_of_the_top_despite_side_faces_and_noise(noise, low_share, bias_limit, rms_limit):
    points = cloud_of(head(160, 79, noise, low_share))
    (rail,) = elevated(network_of(straight_line(160)), points)
    bias, rms = height_error(rail)
    assert abs(bias) < bias_limit
    assert rms < rms_limit


@pytest.mark.parametrize("slope", [-0.12, -0.05, 0.05, 0.12])
def test_height_is_that_of_the_axis_on_an_inclined_head(slope):
    (rail,) = elevated(network_of(straight_line(100)), cloud_of(head(100, 100, slope=slope)))
    bias, rms = height_error(rail)
    assert abs(bias) < 0.0008
    assert rms < 0.0012


def test_weeds_above_and_stones_below_do_not_change_the_height():
    random = np.random.default_rng(5)
    weeds = np.column_stack([random.uniform(0, 100, 200), random.normal(0, 0.03, 200), random.uniform(0.005, 0.2, 200)])
    bush = np.column_stack([random.uniform(40, 40.8, 300), random.normal(0, 0.03, 300), random.uniform(0.03, 0.2, 300)])
    stones = np.column_stack(
        [random.uniform(0, 100, 300), random.normal(0, 0.05, 300), random.uniform(-0.2, -0.05, 300)]
    )
    points = cloud_of(head(100, 100), weeds, bush, stones)
    (rail,) = elevated(network_of(straight_line(100)), points)
    x = np.arange(0, 100, 0.1)
    error = np.interp(x, rail.xyz[:, 0], rail.xyz[:, 2])
    assert abs(error.mean()) < 0.001
    assert np.abs(error).max() < 0.005


@pytest.mark.parametrize("profile", [lambda x: 0.02 * np.sin(2 * np.pi * x / 80), lambda x: 0.04 * x])
def test_waves_and_gradients_keep_their_heights_up_to_the_ends(profile):
    (rail,) = elevated(network_of(straight_line(100)), cloud_of(head(100, 100, profile=profile)))
    bias, rms = height_error(rail, profile)
    assert abs(bias) < 0.001
    assert rms < 0.001
    np.testing.assert_allclose(rail.xyz[[0, -1], 2], profile(np.array([0.0, 100.0])), atol=0.003)


@pytest.mark.parametrize("gap", [2.0, 5.0, 20.0])
def test_heights_continue_across_a_gap_that_counts_as_bridged(gap):
    def profile(x):
        return 0.01 * x

    xyz = head(80, 80, profile=profile)
    xyz = xyz[(xyz[:, 0] < 40) | (xyz[:, 0] > 40 + gap)]
    (rail,) = elevated(network_of(straight_line(80)), cloud_of(xyz))
    x = np.arange(38, 42 + gap, 0.1)
    np.testing.assert_allclose(np.interp(x, rail.xyz[:, 0], rail.xyz[:, 2]), profile(x), atol=0.004)
    assert rail.bridged_m == pytest.approx(gap, abs=0.2)


@pytest.mark.parametrize("grade", [0.0, 0.04, 0.1])
@pytest.mark.parametrize("crossing", [(40.0, 41.5), (38.0, 39.5, 42.0, 43.5), (36.5, 38.0, 40.0, 41.5, 43.5, 45.0)])
def test_a_bridge_does_not_lift_the_rail_that_it_hides(grade, crossing):
    """Where the rails of the bridge cross the line below, only their points are near it."""

    def profile(x):
        return grade * x

    below = head(80, 80, profile=profile)
    below = below[np.abs(below[:, 0] - 40.75) > 5.0]
    random = np.random.default_rng(3)
    above = [np.column_stack([random.uniform(x, x + 0.07, 30), random.uniform(-0.036, 0.036, 30)]) for x in crossing]
    above = np.column_stack([np.concatenate(above), np.full(30 * len(crossing), 6.5) + grade * 40])
    (rail,) = elevated(network_of(straight_line(80)), cloud_of(below, above))
    x = np.arange(0, 80, 0.1)
    np.testing.assert_allclose(np.interp(x, rail.xyz[:, 0], rail.xyz[:, 2]), profile(x), atol=0.006)
    assert rail.bridged_m == pytest.approx(10.0, abs=0.3)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("per_m", [6, 10, 100])
def test_few_points_make_no_gaps_by_chance(seed, per_m):
    """60 m at 10 points per metre have 2.5 m in chance gaps of more than 0.5 m; five gaps of 1.5 m are true."""
    random = np.random.default_rng(seed)
    t = random.uniform(0, 60, 60 * per_m)
    t = t[(t % 12 < 6) | (t % 12 > 7.5)]
    gaps = find_gaps(t, 0.0, 60.0)
    assert 7.4 < np.sum(gaps[:, 1] - gaps[:, 0]) < 7.5 + 5 * 3 / per_m + 1.0


@pytest.mark.parametrize("turn", [1, -1])
def test_gaps_are_where_the_finished_line_has_no_points(turn):
    points = cloud_of(head(40, 80) + [5.0, 0.0, 0.0])
    points = points.kept(np.abs(points.xyz[:, 0] - 21.0) > 1.5)
    (rail,) = elevated(network_of(straight_line(60)[::turn]), points)
    np.testing.assert_allclose(rail.xyz[0, 0], 5.0, atol=0.1)
    np.testing.assert_allclose(rail.gaps, [[14.5, 17.5]], atol=0.2)


@pytest.mark.parametrize("reverse", [False, True])
def test_a_branch_begins_at_the_height_of_its_stock_rail(reverse):
    """The first 8 m of the branch have no points of its own, and what follows climbs away from the stock rail."""
    x = np.arange(0, 40.05, 0.1)
    branch = np.column_stack([x, x**2 / 600.0])
    stock, climbing = head(40.0, 200), head(40.0, 200, profile=lambda x: 0.05 - 0.004 * x, seed=1)
    climbing = climbing[climbing[:, 0] > 8.0] + 0.0
    climbing[:, 1] += climbing[:, 0] ** 2 / 600.0
    network = network_of(straight_line(40.0), branch[::-1] if reverse else branch)
    network = LineNetwork(network.lines, network.nodes, np.array([[0, 1], [2, 0] if reverse else [0, 3]]))
    rails = elevated(network, cloud_of(stock, climbing))
    (rail,) = (one for one in rails if abs(one.xyz[-1, 1]) > 1)
    assert rail.gaps[0] == pytest.approx([0.0, 8.0], abs=0.3)
    height = np.interp([0.0, 12.0, 30.0], rail.xyz[:, 0], rail.xyz[:, 2])
    assert height == pytest.approx([0.0, 0.002, -0.07], abs=0.002)


def test_ridges_of_a_branch_and_its_stock_rail_that_are_one_do_not_lift_either():
    """Blurred by 6 cm, two heads that are nearer than 0.2 m are one ridge, up to twice as high as either."""
    stock, way = straight_line(60), np.arange(0, 40.05, 0.1)
    branch = np.column_stack([20 + way, way**2 / 380])
    rng = np.random.default_rng(4)
    x, y = rng.uniform(0, 60, 40000), rng.uniform(-0.3, 4.5, 40000)
    away = np.where(x > 20, y - np.maximum(x - 20, 0) ** 2 / 380, np.inf)
    near = (np.abs(y) < 0.12) | (np.abs(away) < 0.12)
    up = 0.1 * np.exp(-0.5 * (y / 0.06) ** 2) + 0.1 * np.exp(-0.5 * (away / 0.06) ** 2) + rng.normal(0, 0.004, len(x))
    points = cloud_of(np.column_stack([x, y, up])[near])
    ends, passes = np.array([[0, 1], [2, 3]]), np.array([[2, 0, 200]])
    nodes = np.array([stock[0], stock[-1], branch[0], branch[-1]])
    for rail in elevated(LineNetwork((stock, branch), nodes, ends, passes), points):
        assert np.abs(rail.xyz[:, 2] - 0.1).max() < 0.02


@pytest.mark.parametrize("seed", range(3))
def test_a_ridge_that_two_heads_share_for_long_tells_of_a_change_of_grade(seed):
    """35 m of two rails are one ridge, 11 mm too high, and the 5 m beyond do not show a grade of their own."""
    stock, x = straight_line(75), np.arange(0, 75.05, 0.1)
    other = np.column_stack([x, 0.13 + np.maximum(35 - x, 0) ** 2 / 40 + np.maximum(x - 70, 0) ** 2 / 40])
    rng = np.random.default_rng(seed)
    matching = gaussian_filter1d(rng.normal(0, 1, 1501), 5)
    matching *= 0.008 / matching.std()

    def profile(x):
        return np.maximum(x - 40, 0) ** 2 / 6000

    t, y = rng.uniform(0, 75, 40000), rng.uniform(-0.3, 4, 40000)
    away = y - np.interp(t, *other.T)
    near = (np.abs(y) < 0.12) | (np.abs(away) < 0.12)
    up = 0.1 * np.exp(-0.5 * (y / 0.06) ** 2) + 0.1 * np.exp(-0.5 * (away / 0.06) ** 2) + rng.normal(0, 0.004, len(t))
    up += profile(t) + np.interp(t, 0.05 * np.arange(1501), matching) - 0.1
    points = cloud_of(np.column_stack([t, y, up])[near])
    rail = min(elevated(network_of(stock, other), points), key=lambda one: np.abs(one.xyz[:, 1]).max())
    assert np.abs(rail.xyz[:, 2] - profile(rail.xyz[:, 0])).max() < 0.03


@pytest.mark.parametrize("seed", range(3))
def test_waves_of_the_track_are_no_errors_of_matching(seed):
    """Ridges of images are up to 2 cm too high or low, alike over half a metre; the track rises and falls over 60 m."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 100, 12000), rng.uniform(-0.12, 0.12, 12000)
    matching = gaussian_filter1d(rng.normal(0, 1, 2001), 5)
    matching *= 0.008 / matching.std()

    def profile(x):
        return 0.015 * np.sin(2 * np.pi * x / 60)

    up = 0.1 * np.exp(-0.5 * (y / 0.06) ** 2) - 0.1 + rng.normal(0, 0.004, len(x))
    up += profile(x) + np.interp(x, 0.05 * np.arange(2001), matching)
    (rail,) = elevated(network_of(straight_line(100)), cloud_of(np.column_stack([x, y, up])))
    _, rms = height_error(rail, profile)
    assert rms < 0.004


def test_lines_are_directed_and_numbered_and_have_their_class():
    lines = [straight_line(20)[::-1] + [30.0, 0.0], straight_line(20), straight_line(20)[:, ::-1] + [5.0, 10.0]]
    east = head(20, 80)
    north = east[:, [1, 0, 2]] * [-1, 1, 1]
    points = cloud_of(east + [30.0, 0, 0], east, north + [5.0, 10.0, 0], code=11)
    rails = elevated(network_of(*lines), points)
    assert [rail.rail_id for rail in rails] == [1, 2, 3]
    assert {rail.class_code for rail in rails} == {11}
    np.testing.assert_allclose([rail.xyz[0, :2] for rail in rails], [[0, 0], [5, 10], [30, 0]], atol=1e-9)
    np.testing.assert_allclose([rail.xyz[-1, :2] for rail in rails], [[20, 0], [5, 30], [50, 0]], atol=1e-9)


def test_lines_without_points_and_short_lines_are_left_out():
    lines = [straight_line(20), straight_line(20) + [0.0, 5.0], straight_line(0.8) + [0.0, 10.0]]
    points = cloud_of(head(20, 80), head(0.8, 80) + [0.0, 10.0, 0.0])
    rails = elevated(network_of(*lines), points)
    assert len(rails) == 1
    assert rails[0].xyz[0, 1] == 0.0


def test_rails_without_points_have_no_heights():
    (rail,) = flat_rails(network_of(straight_line(10)[::-1]), 10, PARAMETERS)
    assert np.isnan(rail.xyz[:, 2]).all()
    assert rail.length_m == pytest.approx(10.0)
    assert rail.xyz[0, 0] == 0.0
    assert rail.rail_id == 1


def test_free_ends_without_points_are_cut_and_shared_ends_are_kept():
    line = straight_line(40)
    points = cloud_of(head(30, 100) + [4.0, 0.0, 0.0])
    (rail,) = elevated(network_of(line), points)
    np.testing.assert_allclose(rail.xyz[[0, -1], 0], [4.0, 34.0], atol=0.1)
    assert rail.bridged_m == 0.0
    meeting = network_of(line, straight_line(30) + [40.0, 0.0], straight_line(30) + [40.0, 1.0])
    meeting = LineNetwork(meeting.lines, meeting.nodes, np.array([[0, 1], [1, 3], [1, 5]]))
    (rail,) = elevated(meeting, points)
    np.testing.assert_allclose(rail.xyz[[0, -1], 0], [4.0, 40.0], atol=0.1)
    assert rail.bridged_m == pytest.approx(6.0, abs=0.1)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("count", [0, 1, 3, 9, 10, 12, 30, 100])
@pytest.mark.parametrize("height", [0.01, 0.1, 1.0])
def test_scattered_points_give_a_finite_line_or_none(count, height):
    random = np.random.default_rng(count)
    xyz = random.uniform([0, -0.1, -height], [5, 0.1, height], (count, 3))
    for rail in elevated(network_of(straight_line(5)), cloud_of(xyz)):
        assert np.isfinite(rail.xyz).all()
        assert rail.points >= 10
        assert np.abs(rail.xyz[:, 2]).max() < 3 * height


@pytest.mark.parametrize("seed", range(4))
def test_ends_of_thin_rails_are_cut_where_the_first_point_is_expected(seed):
    """Three points per metre: the third one lies 1 m from the end of the rail on average."""
    random = np.random.default_rng(seed)
    xyz = np.column_stack([random.uniform(0, 80, 240), random.uniform(-0.03, 0.03, 240), np.zeros(240)])
    (rail,) = elevated(network_of(straight_line(80)), cloud_of(xyz))
    third = np.sort(xyz[:, 0])[[2, -3]]
    assert rail.length_m == pytest.approx(min(third[1] + 0.5, 80) - max(third[0] - 0.5, 0), abs=0.25)


def test_a_rail_that_shows_one_face_is_as_high_as_its_top():
    """The middle of what is seen of the face is about 22 mm below the top."""
    random = np.random.default_rng(0)
    x = np.sort(random.uniform(0, 30, 3000))
    xyz = np.column_stack([x, random.normal(0, 0.002, 3000), 4.0 + random.uniform(-0.012, 0.012, 3000)])
    (rail,) = elevated(network_of(straight_line(30.0)), cloud_of(xyz))
    assert np.median(rail.xyz[:, 2]) == pytest.approx(4.022, abs=0.005)
    assert rail.points == 3000


def seen_by_beams(beam_heads):
    """Points, (n, 3), of beams as wide as where their power falls to 1/e²: they blend the head with its bed."""
    rng = np.random.default_rng(3)
    x, across = rng.uniform(0, 60, 2000), rng.uniform(-WIDTH / 2, WIDTH / 2, 2000)
    rays = np.linspace(-1, 1, 101)[:, None]
    beside = np.abs(across + rays * beam_heads * WIDTH) > WIDTH / 2
    z = -0.14 * np.average(beside, axis=0, weights=np.exp(-8 * rays[:, 0] ** 2)) + rng.normal(0, 0.007, 2000)
    return np.column_stack([x, across, z])


@pytest.mark.parametrize("scanned", [False, True])
@pytest.mark.parametrize("beam_heads", [0.5, 0.9, 1.1])
def test_the_standard_error_says_how_far_beams_may_lower_a_head(beam_heads, scanned):
    (rail,) = elevated(network_of(straight_line(60)), cloud_of(seen_by_beams(beam_heads), scanned=scanned))
    assert 1000 * abs(height_error(rail)[0]) < 2 * rail.sigmaz_mm < 20


@pytest.mark.parametrize("beam_heads", [0.9, 1.0, 1.1])
def test_a_head_that_wide_beams_of_a_scanner_lower_is_raised_by_some_of_that(beam_heads):
    """Beams show nothing of how much they lower the crest, a bed 140 mm below it here, and of images less is known."""
    points = [cloud_of(seen_by_beams(beam_heads), scanned=scanned) for scanned in (False, True)]
    lowered_m, raised_m = (height_error(elevated(network_of(straight_line(60)), one)[0])[0] for one in points)
    assert lowered_m < -0.003
    assert 0.7 * lowered_m < raised_m < 0.001


@pytest.mark.parametrize(("length_m", "above_m"), [(6.0, 0.04), (8.0, 0.045), (10.0, 0.055)])
def test_a_pavement_does_not_raise_the_ridge_that_images_show(length_m, above_m):
    """Blur lowers a head between ballast by centimetres, and not one between pavement: no rail rises by that."""
    rng = np.random.default_rng(3)
    x, across = rng.uniform(0, 80, 3000), rng.uniform(-0.07, 0.07, 3000)
    paved = np.abs(x - 40) < length_m / 2
    z = np.where(paved, above_m, -5 * across**2) + rng.normal(0, 0.015, 3000)
    (rail,) = elevated(network_of(straight_line(80)), cloud_of(np.column_stack([x, across, z])))
    assert np.abs(rail.xyz[:, 2] - np.interp(40, [0, 80], rail.xyz[[0, -1], 2])).max() < 0.012
