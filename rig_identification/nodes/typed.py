"""Whether the identifier offers typed services and an action beside the Trigger services."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from rig_identification.nodes.identifier import IdentifierNode

#: Package that is built with a compiler (interfaces/ in the source tree).
PACKAGE = "rig_identification_interfaces"
TRIGGER_ONLY = f"Trigger services alone: {PACKAGE} cannot be imported"
TYPED = f"Trigger services, and the typed ones and the action of {PACKAGE}"


class Typed(Protocol):
    """What the identifier needs of its typed interface."""

    told: str  # which interface there is, for a person

    def look(self) -> None:
        """Go on with what is under way; called every period."""

    def publish(self, latest: dict[str, Any]) -> None:
        """Publish the latest answer."""

    def close(self) -> None:
        """End what is under way; the node ends."""


class TriggerOnly:
    """No typed interface on this machine."""

    def __init__(self, why: str) -> None:
        self.told = f"{TRIGGER_ONLY} ({why})"

    def look(self) -> None:
        """Nothing is under way."""

    def publish(self, latest: dict[str, Any]) -> None:
        """No topic takes it."""

    def close(self) -> None:
        """Nothing is under way."""


def typed_interface(node: IdentifierNode) -> Typed:
    """The typed interface where its package can be imported; which one is there goes to the log."""
    typed: Typed
    try:
        from rig_identification.nodes.typed_services import TypedServices
    except ImportError as error:
        typed = TriggerOnly(str(error))
    else:
        typed = TypedServices(node)
    node.get_logger().info(typed.told)
    return typed
