"""The site: the pages of this folder and a reference of all public names, as HTML that works from the disk.

python -m sphinx -W -b html docs generated/site
"""

import gc
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "extensions"))

import symdyn

gc.set_threshold(200_000, 20, 50)  # documents are many small nodes that stay; looking for garbage takes a sixth of the time

project = "symdyn"
author = copyright = "the symdyn developers"
release = version = symdyn.__version__
html_title = f"symdyn {version}"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_copybutton", "docstrings", "gallery", "mathml", "measured",
              "navigation", "tables", "tolerance", "tutorials", "outside"]
exclude_patterns = ["extensions"]
root_doc = "index"
source_suffix = {".rst": "restructuredtext", ".md": "markdown", ".myst": "markdown"}

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
python_use_unqualified_type_names = True
maximum_signature_line_length = 90
suppress_warnings = ["ref.python"]  # a class called like another: the type in a signature is not linked
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_static_path = ["static", "../generated/gallery"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}
copybutton_prompt_text = r">>> |\.\.\. "
copybutton_prompt_is_regexp = True
