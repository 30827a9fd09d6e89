"""Whether the infrared of an Aseba node carries words, as that of a Thymio II does (`prox.comm`), and by what."""

from crcolony_bridge.aseba.models import IrWords
from crcolony_bridge.aseba.program import WordPort
from crcolony_bridge.aseba.protocol import NodeDescription

NO_WORD = -1
"""What is sent while there is nothing to send"""


def find_word_port(rule: IrWords | None, node: NodeDescription) -> WordPort | None:
    """Return by what this node sends and receives words, None if it does not."""
    if rule is None:
        return None
    has_variables = {rule.sent, rule.received, rule.known_by} <= node.addresses.keys()
    if not (has_variables and rule.event in node.local_events and rule.enable in node.natives):
        return None
    sent, received = node.address(rule.sent), node.address(rule.received)
    return WordPort(sent, received, rule.event, rule.enable)
