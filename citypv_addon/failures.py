"""Say in the panel which libraries are missing or failed to load."""

from ..operators.check_libraries import list_failures
from .report import draw_sentence


def draw_failures(layout):
    """Show each failure with its cure; nothing where all is well."""
    for sentence in list_failures():
        draw_sentence(layout.box().column(align=True), sentence, icon="ERROR")
