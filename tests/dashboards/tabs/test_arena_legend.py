"""The legend explains every mark of the arena, in the colours of the arena."""

from crcolony_dashboards.tabs import palette
from crcolony_dashboards.tabs.arena_legend import LEGEND, draw_legend

from tests.support.drawn import RecordingStreams


def test_every_mark_is_explained() -> None:
    """Ring, face, white ball, fan, path, packs and lines; valid at all times."""
    streams = RecordingStreams()
    draw_legend(streams)
    assert all(drawing.is_static for drawing in streams.drawings)
    texts = [
        text
        for drawing in streams.drawings
        if "labels" in drawing.parts
        for text in drawing.parts["labels"].to_pylist()
    ]
    words = " ".join(texts)
    for mark in ("face: foraging", "face: mating", "ring: energy", "white ball", "fan", "path"):
        assert mark in words
    for mark in ("battery pack", "they met", "they mated", "conceived", "no news"):
        assert mark in words
    assert streams.colours(f"{LEGEND}/faces")[:2] == list(palette.MODULES)
    assert streams.colours(f"{LEGEND}/lines") == [palette.MET, palette.MATED, palette.CONCEIVED]
    levels = palette.energy_colours([0.0, 0.5, 1.0]).tolist()
    assert streams.colours(f"{LEGEND}/rings")[2:5] == [tuple(level) for level in levels]
