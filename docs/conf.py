"""Sphinx's settings. The build fetches nothing."""

from __future__ import annotations

import sumo3dviz_pt

project = "sumo3dviz_pt"
author = "The sumo3dviz_pt developers"
copyright = "2026, The sumo3dviz_pt developers"
version = release = sumo3dviz_pt.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
autodoc_typehints = "description"
autodoc_member_order = "bysource"
exclude_patterns = ["_build", "_bench/*.md"]
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["manual.css"]
html_title = f"sumo3dviz_pt {release}"
