"""Prints of pictures tell what an eye would, and what a codec does stays far below."""

import subprocess

import numpy as np
import pytest

from sumo3dviz_pt.errors import InputError
from sumo3dviz_pt.video import encode
from sumo3dviz_pt.video.codecs import CODECS
from sumo3dviz_pt.video.ffmpeg import ffmpeg_path
from sumo3dviz_pt.video.prints import Apart, as_text, film_prints, print_in, print_of

SIZE = (160, 90)


def film(count=6):
    """A textured street of few colours; a box moves through it by three pixels a frame, 8 bit."""
    rng = np.random.default_rng(5)
    stones = rng.integers(60, 190, (45, 80, 1)) + rng.normal(0, 3, (45, 80, 3))
    walls = np.linspace(-9, 9, 80)[None, :, None] * (1.0, -0.2, -0.8)
    street = np.repeat(np.repeat(stones + walls, 2, 0), 2, 1)
    for number in range(count):
        picture = street.copy()
        picture[50:62, 20 + 3 * number : 44 + 3 * number] = (180, 30, 40)
        yield (picture + rng.normal(0, 0.5, picture.shape)).clip(0, 255) / np.float32(255)


def written(path, pictures, codec="h264"):
    """Encode pictures; the prints of what the encoder got, and how far the film is from them."""
    fed = encode(pictures, path, size=SIZE, fps=25, codec=codec)
    return fed, apart(path, fed, codec)


def apart(path, fed, codec="h264"):
    found = film_prints(path, codec=CODECS[codec], size=SIZE)
    assert len(found.prints) == len(fed)
    return [Apart.between(own, wanted) for own, wanted in zip(found.prints, fed, strict=True)]


def broken(found, bound):
    """Which frames are farther from what was developed than the codec brought them."""
    pairs = enumerate(zip(found, bound, strict=True))
    return [number for number, (own, limit) in pairs if own.beyond(limit)]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    path = tmp_path_factory.mktemp("prints") / "a.mp4"
    return (path, *written(path, film()))


@pytest.mark.parametrize("codec", sorted(CODECS))
def test_a_codec_changes_a_picture_by_little_and_decodes_alike_each_time(codec, tmp_path):
    path = tmp_path / f"a{CODECS[codec].suffixes[0]}"
    fed, bound = written(path, film(3), codec)
    assert not broken(apart(path, fed, codec), bound)
    most = 12.0 if codec == "gif" else 4.0  # a GIF has 256 colours
    assert all(each.shade < 0.6 and each.block < 3.0 and each.pixel < most for each in bound)


def test_a_film_says_when_its_pictures_are_shown_and_how_large_they_are(made):
    found = film_prints(made[0], codec=CODECS["h264"], size=SIZE)
    assert found.words.times == pytest.approx([n / 25 for n in range(6)])
    assert found.words.size == SIZE and found.words.duration == pytest.approx(6 / 25)


def swapped(pictures):
    pictures[2], pictures[3] = pictures[3], pictures[2]


def darkened(pictures):
    pictures[4] = np.zeros_like(pictures[4])


def cast(pictures):
    for picture in pictures:
        picture[..., 2] = (picture[..., 2] + 2 / 255).clip(0, 1)


def person(pictures):
    """A tenth of a percent of the picture, a little darker than what is behind."""
    for picture in pictures:
        picture[30:36, 100:102] -= 0.2


def dull(pictures):
    """Less saturated by a twelfth; each pixel is as light as before."""
    for picture in pictures:
        luma = (picture @ (0.2126, 0.7152, 0.0722))[..., None]
        picture[:] = luma + (picture - luma) * (11 / 12)


def hue(pictures):
    """Colours turned by 5 degrees: as light and as saturated as before."""
    angle, to_luma = np.radians(5.0), np.array([0.2126, 0.7152, 0.0722])
    for picture in pictures:
        luma = picture @ to_luma
        blue, red = (picture[..., 2] - luma) / 1.8556, (picture[..., 0] - luma) / 1.5748
        blue, red = (
            blue * np.cos(angle) - red * np.sin(angle),
            blue * np.sin(angle) + red * np.cos(angle),
        )
        picture[..., 2], picture[..., 0] = luma + 1.8556 * blue, luma + 1.5748 * red
        picture[..., 1] = (luma - picture[..., 0] * 0.2126 - picture[..., 2] * 0.0722) / 0.7152


def flat(pictures):
    """Less contrast by a twentieth; the whole picture is as light as before."""
    for picture in pictures:
        picture[:] = picture.mean() + (picture - picture.mean()) * 0.95


def chequers(height, side):
    """Chequers in an eighth of a picture: the means of blocks stay what they are."""

    def paint(pictures):
        for picture in pictures:
            rows, columns = np.mgrid[0:40, 0:40] // side
            picture[:40, :40, :] += np.where((rows + columns) % 2, height, -height)[..., None]

    return paint


def coloured_chequers(pictures):
    """The same of colour alone."""
    for picture in pictures:
        rows, columns = np.mgrid[0:40, 0:40] // 4
        by = np.where((rows + columns) % 2, 0.06, -0.06)
        picture[:40, :40, 0] += by
        picture[:40, :40, 1] -= by * 0.2126 / 0.7152


ALL = [*range(6)]
SPOILT = {
    **{swapped: [2, 3], darkened: [4], cast: ALL, person: ALL, dull: ALL, hue: ALL, flat: ALL},
    **{chequers(0.05, 1): ALL, chequers(0.05, 2): ALL, coloured_chequers: ALL},
}


@pytest.mark.parametrize("spoil", SPOILT, ids=lambda each: each.__name__)
def test_what_was_done_to_some_frames_is_told_by_these(spoil, made, tmp_path):
    _, fed, bound = made
    pictures = list(film())
    spoil(pictures)
    path = tmp_path / "b.mp4"
    encode(pictures, path, size=SIZE, fps=25)
    found = apart(path, fed)
    told = broken(found, bound)
    assert set(SPOILT[spoil]) <= set(told)
    # What is before and after a broken picture is told, too, if the codec made it from that.
    worst = max(told, key=lambda number: found[number].beyond(bound[number]))
    assert worst in SPOILT[spoil] and (len(told) <= len(SPOILT[spoil]) or spoil is darkened)


def test_a_recoding_is_told_in_every_frame(made, tmp_path):
    path, fed, bound = made
    again = tmp_path / "b.mp4"
    command = [ffmpeg_path(), "-loglevel", "error", "-i", str(path), "-crf", "45", str(again)]
    subprocess.run(command, check=True)
    assert broken(apart(again, fed), bound) == [*range(6)]


def test_a_print_is_the_same_after_text_and_other_shapes_are_far_apart(made):
    fed = made[1]
    np.testing.assert_array_equal(print_in(as_text(fed[0])), fed[0])
    small = print_of([np.zeros((4, 4), np.uint8)] * 3, bits=8)
    assert small.shape == (8, 16)
    assert Apart.between(small, fed[0]).beyond(made[2][0]) == np.inf


def test_signed_sums_estimate_the_root_mean_square_difference():
    rng = np.random.default_rng(1)
    one = rng.integers(0, 200, (180, 320))
    other = one + rng.integers(-6, 7, one.shape)
    true = float(np.sqrt(((one - other) ** 2).mean()))
    found = Apart.between(*(print_of([each] * 3, bits=8) for each in (one, other)))
    assert found.pixel == pytest.approx(true, rel=0.25)


def test_what_is_no_film_is_refused(tmp_path):
    path = tmp_path / "a.mp4"
    path.write_bytes(b"no film")
    with pytest.raises(InputError, match="can be decoded"):
        film_prints(path, codec=CODECS["h264"], size=SIZE)


@pytest.mark.parametrize("size", [(16, 32), (18, 32), (2, 2), (8, 300)])
def test_small_pictures_have_prints_whose_planes_agree(size):
    """Planes of colour are half as large, which may be fewer pixels than there are blocks."""
    rng = np.random.default_rng(3)
    half = (size[0] // 2, size[1] // 2)
    planes = [rng.integers(0, 255, side, dtype=np.uint8) for side in (size, half, half)]
    found = print_of(planes, bits=8)
    assert found.shape == (8, min(9, half[0]) * min(16, half[1]))
    assert found[0].mean() / 64.0 == pytest.approx(planes[0].mean(), abs=4.0)
