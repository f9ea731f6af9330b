"""How Sphinx makes the site: ``sphinx-build -W --keep-going docs build/docs``."""

import inspect
import re
import sys
from html import escape
from importlib import import_module
from pkgutil import iter_modules

from docutils import nodes
from sphinx.pycode import ModuleAnalyzer

import turing_learning
from turing_learning.config import Section

project = "Turing Learning for Python"
author = "the Turing Learning maintainers"
version = release = turing_learning.__version__
copyright = "MIT licence"

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
]
exclude_patterns = ["decisions/0000-template.md"]
default_role = "literal"

myst_heading_anchors = 3
nb_execution_mode = (
    "off"  # notebooks are committed as `jupyter execute --inplace docs/gallery/*.ipynb` leaves them
)
copybutton_selector = "div:not(.highlight-text):not(.output) > div.highlight > pre"
suppress_warnings = ["ref.python"]  # the words of a shape, "(size, dimension)", are no references

napoleon_google_docstring = False
napoleon_custom_sections = ["Source", ("Attributes", "params_style")]
napoleon_use_ivar = True
napoleon_use_param = False
napoleon_use_rtype = False
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_class_signature = "mixed"
autodoc_default_options = {"exclude-members": "model_config"}

PAGE_IN_WORDS = re.compile(r"(?<![\w/`])docs/((?:\w+/)?[\w-]+)(?:\.md)?")
LONGEST_VALUE = 150  # of a constant, in characters

html_theme = "furo"
html_title = "Turing Learning"
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_favicon = "_static/favicon.svg"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0072b2", "color-brand-content": "#0072b2"},
    "dark_css_variables": {"color-brand-primary": "#56b4e9", "color-brand-content": "#56b4e9"},
}


def setup(app):
    """Connect what follows."""
    app.connect("builder-inited", carry_words_of_constants)
    app.connect(
        "autodoc-process-docstring", keep_first_sentence, priority=400
    )  # before napoleon reads it
    app.connect("autodoc-process-docstring", link_pages, priority=600)
    app.connect("autodoc-process-signature", say_settings_without_their_rules)
    app.connect("source-read", carry_experiments)
    app.connect("source-read", carry_linked_files)
    app.connect("html-page-context", describe)


def carry_experiments(app, name, source):
    """Fill the pages of experiments with what is written beside their tables and figures, and link to these pages."""
    source[0] = re.sub(
        r"\]\(\.\./experiments/((?:as-printed/)?[^/)]+)/README\.md(#[^)]+)?\)",
        r"](experiments/\1.md\2)",
        source[0],
    )
    folder, _, page = name.partition("/")
    if folder == "experiments" and page != "index":
        path = app.srcdir.parent / "experiments" / page / "README.md"
        up = "../" * (name.count("/") + 1)
        text = re.sub(
            r"(!\[[^\]]*\])\((?=figures/)",
            rf"\1({up}experiments/{page}/",
            path.read_text(encoding="utf-8"),
        )
        source[0] = re.sub(
            r"(?<!!)(\[[^\]]*\])\((?=tables/)", rf"\1(path:{up}experiments/{page}/", text
        )
        app.env.note_dependency(str(path))


def carry_linked_files(app, name, source):
    """Make links out of this folder, of pages that code writes, into files that come along with the site."""
    if "/" not in name:
        source[0] = re.sub(r"(?<!!)(\[[^\]]*\])\(\.\./(?=[^)]+\))", r"\1(path:../", source[0])


def describe(app, name, template, context, doctree):
    """Give a page without a description its first paragraph for one."""
    paragraph = next(doctree.findall(nodes.paragraph), None) if doctree is not None else None
    if paragraph is not None and 'name="description"' not in context["metatags"]:
        context["metatags"] += (
            f'<meta name="description" content="{escape(" ".join(paragraph.astext().split()))}">'
        )


def carry_words_of_constants(app):
    """Let a room show the docstrings of the constants that it takes from its modules; autodoc looks for them in the room alone."""
    for room in [
        import_module(f"turing_learning.{each.name}")
        for each in iter_modules(turing_learning.__path__)
        if each.ispkg
    ]:
        names = [
            name for name in getattr(room, "__all__", ()) if not _has_docstring(getattr(room, name))
        ]
        docs = _docs(room.__name__)
        for name in names:
            for module in [each for each in sys.modules if each.startswith(f"{room.__name__}.")]:
                if getattr(sys.modules[module], name, None) is getattr(room, name) and (
                    "",
                    name,
                ) in _docs(module):
                    docs["", name] = _docs(module)["", name] + _hidden(getattr(room, name))


def keep_first_sentence(app, what, name, obj, options, lines):
    """Keep the docstring of a property or constant as it is: napoleon takes what is before its first colon for a type."""
    if what in ("attribute", "data", "property") and lines and ":" in lines[0]:
        lines[0] = f": {lines[0]}"


def link_pages(app, what, name, obj, options, lines):
    """Make links of the pages that a docstring names by their files: docs/limits.md, or docs/decisions/0005."""
    lines[:] = [
        PAGE_IN_WORDS.sub(lambda named: _link(app.srcdir, *named.groups()), line) for line in lines
    ]


def _link(folder, page):
    [*found] = sorted(folder.glob(f"{page}.md")) or sorted(folder.glob(f"{page}-*.md"))
    return (
        f":doc:`docs/{page} </{found[0].relative_to(folder).with_suffix('')}>`"
        if found
        else f"docs/{page}"
    )


def say_settings_without_their_rules(app, what, name, obj, options, signature, returned):
    """Show the keys of a section of the configuration; the table of settings says the rest."""
    if what == "class" and issubclass(obj, Section) and obj.model_fields:
        return f"(*, {', '.join(obj.model_fields)})", returned
    return None


def _hidden(value):
    return ["", ":meta hide-value:", ""] if len(repr(value)) > LONGEST_VALUE else []


def _has_docstring(value):
    return inspect.isroutine(value) or inspect.isclass(value)


def _docs(module):
    analyzer = ModuleAnalyzer.for_module(module)
    analyzer.analyze()
    return analyzer.attr_docs
