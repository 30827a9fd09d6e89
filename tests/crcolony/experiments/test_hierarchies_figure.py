"""The figure shows a hierarchy as it is."""

from crcolony.evolution.typed_tree import parse_tree
from crcolony.experiments.hierarchies_figure import draw_tree


def test_every_subtask_has_a_row_and_stands_right_of_its_parent() -> None:
    """Composite ones are bold."""
    from matplotlib.figure import Figure

    axes = Figure().subplots()
    draw_tree(axes, parse_tree("Root(BringHome(ToNest), ToPack)"))
    places = [(text.get_text(), *text.get_position()) for text in axes.texts]
    assert places == [("Root", 0, 0), ("BringHome", 1, 1), ("ToNest", 2, 2), ("ToPack", 1, 3)]
    assert [text.get_fontweight() for text in axes.texts] == ["bold", "bold", "normal", "normal"]
