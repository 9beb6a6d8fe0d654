"""Classified copies of files: classes change, everything else stays; tiles and catalogue."""

import sys

import numpy as np
import pytest
from rail_extract.core.classify.settings import Settings
from rail_extract.core.clouds.header import list_tiles
from rail_extract.core.clouds.las import laspy
from rail_extract.core.clouds.points import ask
from rail_extract.core.disk import scratch_folder
from rail_extract.core.errors import CloudError, DiskError, RailExtractError
from rail_extract.core.labelling.files import Content, classify_files, plan_output
from rail_extract.core.progress import Progress, Recording
from rail_extract.core.run.tasks import Answer, InTurn, Runner
from rail_extract.core.standards import SEARCHED_CLASSES
from rail_extract.laboratory.scenes.raw_shapes import flat, rough, with_track

GAUGE, WIDTH = 1.435, 0.072
SETTINGS = Settings((GAUGE,), WIDTH)
TEN = Content(10)
CORNER = np.array([500_000.0, 5_000_000.0, 100.0])


@pytest.fixture(scope="module")
def scene():
    """8 m of track across the border of two squares, shuffled; which points are on heads."""
    rng = np.random.RandomState(3)
    xyz, on = with_track(flat(8.0, rng=rng, per_m2=2500), GAUGE, WIDTH, 0.3)
    order = rng.permutation(len(xyz))
    corner = np.round(CORNER / SETTINGS.side_m) * SETTINGS.side_m * [1, 1, 0] + [0, 0, 100]
    return (rough(xyz, rng) + corner - [4, 4, 0])[order], on[order]


def save(path, xyz, point_format=6, codes=None):
    rng = np.random.RandomState(5)
    header = laspy.LasHeader(point_format=point_format, version="1.4" if point_format > 5 else "1.2")
    header.scales, header.offsets = [0.0005] * 3, CORNER
    header.add_extra_dim(laspy.ExtraBytesParams("tie", np.uint16, description="sleepers"))
    header.vlrs.append(laspy.VLR("someone", 77, "notes", b"\x01\x02\x00"))
    cloud = laspy.LasData(header)
    cloud.x, cloud.y, cloud.z = xyz.T
    cloud.classification = np.full(len(xyz), 2) if codes is None else codes
    for name, most in (("intensity", 60_000), ("tie", 60_000), ("gps_time", 1000), ("key_point", 2), ("user_data", 99)):
        if name in header.point_format.dimension_names:
            cloud[name] = rng.randint(0, most, len(xyz))
    if point_format > 5:
        cloud.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("someone", 78, "late", b"late")])
    cloud.write(path)
    return path


def classify(tmp_path, paths, output, choice=TEN, progress=None, runner=None):
    """Plan and write; returns the result and the progress."""
    progress = progress or Recording(Progress())
    planned = plan_output(paths, output, choice.class_code, progress)
    request = ask(paths, SEARCHED_CLASSES, None, None, progress)
    with scratch_folder(tmp_path) as work:
        return classify_files(request, SETTINGS, choice, planned, work, runner or Runner(), progress), progress


@pytest.mark.parametrize(
    ("suffix", "point_format", "new"),
    [(".las", 6, ".laz"), (".laz", 6, ".las"), (".las", 1, ".las"), (".laz", 7, ".laz")],
)
def test_only_the_classes_change(tmp_path, scene, suffix, point_format, new):
    xyz, on = scene
    source = save(tmp_path / f"raw{suffix}", xyz, point_format)
    result, _ = classify(tmp_path, [source], tmp_path / f"new{new}")
    before, after = laspy.read(source), laspy.read(result.file)
    found = np.asarray(after.classification) == 10
    assert result.point_count == len(xyz)
    assert result.figures.points == found.sum()
    assert (found & on).sum() / on.sum() > 0.97
    assert (found & on).sum() / found.sum() > 0.97
    assert np.all(np.asarray(after.classification)[~found] == 2)
    for name in before.point_format.dimension_names:
        if name != "classification":
            assert np.array_equal(np.asarray(before[name]), np.asarray(after[name])), name
    assert np.array_equal(before.header.scales, after.header.scales)
    assert np.array_equal(before.header.offsets, after.header.offsets)
    records = [
        [(one.user_id, one.record_id, one.record_data_bytes()) for one in cloud.vlrs] for cloud in (before, after)
    ]
    assert records[0] == records[1]
    assert [one.record_data_bytes() for one in after.evlrs or ()] == [
        one.record_data_bytes() for one in before.evlrs or ()
    ]


def test_text_in_other_characters_than_ascii_stays_as_it_is(tmp_path, scene):
    source = save(tmp_path / "raw.las", scene[0])
    data = source.read_bytes()
    head = data[:1000].replace(b"notes\0", b"n\xf6tes\0")
    head = head[:26] + "G\u00f6ttingen".encode("latin-1").ljust(32, b"\0") + head[58:]
    source.write_bytes(head + data[1000:])
    result, _ = classify(tmp_path, [source], tmp_path / "new.las")
    copied = result.file.read_bytes()[:1000]
    assert copied[26:58] == head[26:58]
    assert head.count(b"n\xf6tes\0") == copied.count(b"n\xf6tes\0") > 0


def test_a_record_of_a_user_whose_name_can_not_be_copied_is_refused(tmp_path, scene):
    source = save(tmp_path / "raw.las", scene[0])
    data = source.read_bytes()
    source.write_bytes(data[:1000].replace(b"someone\0", "s\u00f6meon\0".encode()) + data[1000:])
    with pytest.raises(CloudError, match=r"raw.las is cut off or damaged"):
        classify(tmp_path, [source], tmp_path / "new.las")
    assert [one.name for one in tmp_path.iterdir()] == ["raw.las"]


def test_the_rail_class_is_reset_or_kept_and_other_points_are_left_out(tmp_path, scene):
    xyz, on = scene
    codes = np.where(np.arange(len(xyz)) % 2, 10, 7)
    codes[on] = 2
    source = save(tmp_path / "raw.las", xyz, codes=codes)
    counts = {}
    for name, choice in {
        "reset": Content(11),
        "kept": Content(10, reset=False),
        "ten": TEN,
        "only": Content(12, only_rails=True),
    }.items():
        result, _ = classify(tmp_path, [source], tmp_path / f"{name}.las", choice)
        counts[name] = np.bincount(laspy.read(result.file).classification, minlength=20), result.figures.points
    assert counts["only"][0].sum() == counts["only"][0][12] == counts["only"][1]
    assert counts["kept"][0][1] == 0
    assert counts["ten"][0][10] == counts["ten"][1]
    assert counts["ten"][0][7] == (codes == 7).sum()


def test_tiles_are_classified_as_one_cloud(tmp_path, scene):
    xyz, _ = scene
    west = xyz[:, 0] < np.median(xyz[:, 0])
    raw = tmp_path / "raw"
    raw.mkdir()
    save(raw / "west.laz", xyz[west])
    save(raw / "east.las", xyz[~west])
    whole, _ = classify(tmp_path, [save(tmp_path / "whole.las", xyz)], tmp_path / "one.las")
    for _ in range(2):  # the second run replaces the tiles of the first
        result, _ = classify(tmp_path, [raw], tmp_path / "new.laz")
    assert result.file == tmp_path / "new.vpc"
    assert [tile.resolve() for tile in list_tiles(result.file)] == [
        tmp_path / "new/east.las",
        tmp_path / "new/west.laz",
    ]
    codes = np.empty(len(xyz), dtype=int)
    codes[west] = laspy.read(tmp_path / "new/west.laz").classification
    codes[~west] = laspy.read(tmp_path / "new/east.las").classification
    assert np.array_equal(codes, laspy.read(whole.file).classification)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["new", "new.vpc", "one.las", "raw", "whole.las"]
    (tmp_path / "new" / "diary.txt").write_text("mine")
    with pytest.raises(DiskError, match="new exists and holds other files: choose another name"):
        classify(tmp_path, [raw], tmp_path / "new.laz")


class Backwards(InTurn):
    """Executes tasks in the opposite order, and fails where it is told to."""

    places = 99

    def __init__(self, failing="nothing"):
        super().__init__()
        self.failing = failing

    def wait(self, progress, advance):
        self._started.rotate(1)
        does_fail = self._started[0][1].label.startswith(self.failing)
        name, answer = super().wait(progress, advance)
        return name, Answer(error=ValueError("reason")) if does_fail else answer


@pytest.mark.skipif(sys.platform == "win32", reason="Windows lets few users make links")
def test_a_link_to_the_folder_of_tiles_stays_and_a_link_to_itself_is_refused(tmp_path, scene):
    tiles = [save(tmp_path / f"{name}.las", scene[0]) for name in "ab"]
    (tmp_path / "real").mkdir()
    (tmp_path / "new").symlink_to("real")
    result, _ = classify(tmp_path, tiles, tmp_path / "new.vpc")
    assert (tmp_path / "new").is_symlink()
    assert sorted(one.name for one in (tmp_path / "real").iterdir()) == ["a.las", "b.las"]
    assert [len(laspy.read(tile).points) for tile in list_tiles(result.file)] == [len(scene[0])] * 2
    (tmp_path / "loop.las").symlink_to("loop.las")
    with pytest.raises(DiskError, match="can't be written"):
        classify(tmp_path, tiles[:1], tmp_path / "loop.las")


def test_any_runner_gives_the_same_files(tmp_path, scene):
    tiles = tmp_path / "raw"
    tiles.mkdir()
    for name, part in zip(("a.las", "b.las", "c.las"), np.array_split(scene[0], 3)):
        save(tiles / name, part)
    written = []
    for runner in (Runner(), Runner(Backwards())):
        result, _ = classify(tmp_path, [tiles], tmp_path / "new.vpc", runner=runner)
        written.append([result.figures, *(one.read_bytes() for one in sorted((tmp_path / "new").iterdir()))])
    assert written[0][0].paired_m > 14
    assert written[0] == written[1]


@pytest.mark.parametrize("failing", ["Reading b.las", "Searching", "Writing b.las"])
def test_nothing_is_written_where_a_part_failed(tmp_path, scene, failing):
    tiles = tmp_path / "raw"
    tiles.mkdir()
    for name, part in zip(("a.las", "b.las"), np.array_split(scene[0], 2)):
        save(tiles / name, part)
    with pytest.raises(RailExtractError, match=rf"{failing}.* failed \(reason\). Nothing was written."):
        classify(tmp_path, [tiles], tmp_path / "new.vpc", runner=Runner(Backwards(failing), tolerant=True))
    assert [one.name for one in tmp_path.iterdir()] == ["raw"]


def test_ground_has_no_rail(tmp_path):
    xyz = rough(flat(8.0, rng=np.random.RandomState(1), per_m2=500), np.random.RandomState(2)) + CORNER
    result, progress = classify(tmp_path, [save(tmp_path / "raw.las", xyz)], tmp_path / "new.copc.laz")
    assert result.file == tmp_path / "new.laz"
    assert (laspy.read(result.file).classification == 2).all()
    assert progress.warnings[0] == "new.copc.laz is written as new.laz: COPC files can't be written."
    assert [one.split(":")[0] for one in progress.warnings[1:]] == [
        "The cloud has no coordinate system",
        "No rail was found",
    ]


@pytest.mark.parametrize("count", [1, 2])
def test_of_two_runs_onto_one_output_the_later_one_says_so_and_changes_nothing(tmp_path, scene, count):
    sources = [save(tmp_path / f"raw{number}.las", scene[0][:20_000]) for number in range(count)]
    output = tmp_path / ("new.las" if count == 1 else "new.vpc")
    first, second = (plan_output(sources, output, code) for code in (10, 11))
    request = ask(sources, SEARCHED_CLASSES)

    def run(choice, planned):
        with scratch_folder(tmp_path) as work:
            classify_files(request, SETTINGS, choice, planned, work, Runner())

    def content():
        return {path: path.read_bytes() for path in [output, *tmp_path.glob("new/*")]}

    run(TEN, first)
    written = content()
    with pytest.raises(DiskError, match="was changed by another program in the meantime"):
        run(Content(11), second)
    assert content() == written
    assert [path.name for path in tmp_path.glob("*_new*")] == (["new_new.las"] if count == 1 else [])


def test_a_copc_file_loses_only_the_records_of_its_octree(tmp_path, scene):
    source = save(tmp_path / "plain.las", scene[0])
    cloud = laspy.read(source)
    cloud.header.vlrs.append(laspy.VLR("copc", 1, "copc info", bytes(160)))
    cloud.evlrs.append(laspy.VLR("copc", 1000, "hierarchy", b"octree"))
    cloud.write(tmp_path / "raw.copc.laz")
    result, _ = classify(tmp_path, [tmp_path / "raw.copc.laz"], tmp_path / "new.laz")
    after = laspy.read(result.file)
    assert {one.user_id for one in after.vlrs} == {"LASF_Spec", "someone"}
    assert [one.user_id for one in after.evlrs] == ["someone"]
    assert len(after.points) == len(scene[0])


def test_records_that_are_cut_off_are_noticed(tmp_path, scene):
    source = save(tmp_path / "raw.las", scene[0])
    source.write_bytes(source.read_bytes()[:-2])
    with pytest.raises(CloudError, match=r"raw.las"):
        classify(tmp_path, [source], tmp_path / "new.las")
    assert [one.name for one in tmp_path.iterdir()] == ["raw.las"]
