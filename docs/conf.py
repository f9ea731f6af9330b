"""How Sphinx makes the site: ``sphinx-build -W --keep-going docs build/docs``."""

import re

import turing_learning

project = "Turing Learning for Python"
author = "the Turing Learning maintainers"
version = release = turing_learning.__version__
copyright = "MIT licence"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode"]
exclude_patterns = ["decisions/0000-template.md"]
default_role = "literal"

myst_heading_anchors = 3
suppress_warnings = ["ref.python"]  # the words of a shape, "(size, dimension)", are no references

napoleon_google_docstring = False
napoleon_custom_sections = ["Source"]
napoleon_use_ivar = True
napoleon_use_param = False
napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_class_signature = "mixed"

html_theme = "furo"
html_title = "Turing Learning"
html_copy_source = False
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0072b2", "color-brand-content": "#0072b2"},
    "dark_css_variables": {"color-brand-primary": "#56b4e9", "color-brand-content": "#56b4e9"},
}


def setup(app):
    """Connect what follows."""
    app.connect("source-read", carry_linked_files)


def carry_linked_files(app, name, source):
    """Make links out of this folder, of pages that code writes, into files that come along with the site."""
    if "/" not in name:
        source[0] = re.sub(r"(?<!!)(\[[^\]]*\])\(\.\./(?=[^)]+\))", r"\1(path:../", source[0])
