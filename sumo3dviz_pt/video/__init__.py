"""Encodes frames as films with true BT.709 tags, in constant memory."""

from sumo3dviz_pt.video.codecs import AUTO, CODECS, FILM_SUFFIXES, Codec, codec_named, frame_rate
from sumo3dviz_pt.video.encoder import check_film, encode
from sumo3dviz_pt.video.ffmpeg import ProbedFilm, probe

__all__ = [
    "AUTO",
    "CODECS",
    "FILM_SUFFIXES",
    "Codec",
    "ProbedFilm",
    "check_film",
    "codec_named",
    "encode",
    "frame_rate",
    "probe",
]
