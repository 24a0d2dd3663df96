"""What every page shares: templates that escape each name, and one style."""

from __future__ import annotations

from importlib import resources

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


def script(environment: Environment, *names: str) -> Markup:
    """Scripts of this package, which a page holds in itself."""
    assert environment.loader is not None
    return Markup("\n".join(environment.loader.get_source(environment, name)[0] for name in names))


def vendored(*parts: str) -> Markup:
    """A file of another project that a page holds in itself: ``vendored("uplot", "uPlot.min.css")``."""
    file = resources.files("rig_identification.report").joinpath("vendored", *parts)
    return Markup(file.read_text(encoding="utf-8"))


def page_environment() -> tuple[Environment, Markup]:
    """Templates of this package, and the style sheet that a page holds in itself."""
    environment = Environment(
        loader=PackageLoader("rig_identification.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    style = environment.loader.get_source(environment, "style.css")[0] if environment.loader else ""
    return environment, Markup(style)
