"""A film that is over is put in order, or left as it is."""

from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb
from crcolony_dashboards.rerun_streams import Moment, RerunStreams
from crcolony_dashboards.rrd_file import open_film, optimize_rrd
from rerun.chunk import RrdReader


def test_a_film_in_order_has_an_index_and_is_smaller(tmp_path: Path) -> None:
    """It can be sought in, and holds what it held."""
    path = tmp_path / "film.rrd"
    rrd = open_film(path, "run", rrb.Blueprint(rrb.TextLogView(origin="/log")))
    streams = RerunStreams(None, rrd)
    for k in range(50):
        streams.set_time(Moment(1.79e9 + k, 1.0 * k, 0))
        streams.log("/a", rr.Points2D([(k, 0.0)]))
        assert rrd.check() is None
    streams.close()
    before = path.stat().st_size
    optimize_rrd(path)
    assert path.stat().st_size < before
    assert [file.name for file in tmp_path.iterdir()] == ["film.rrd"]
    assert RrdReader(path).store() is not None
    points = [chunk.num_rows for chunk in RrdReader(path).stream() if chunk.entity_path == "/a"]
    assert sum(points) == 50


def test_what_is_no_film_stays_as_it_is(tmp_path: Path) -> None:
    """Nothing is lost, and nothing is left beside it."""
    path = tmp_path / "film.rrd"
    path.write_bytes(b"no film")
    optimize_rrd(path)
    assert path.read_bytes() == b"no film"
    assert [file.name for file in tmp_path.iterdir()] == ["film.rrd"]
