# docs - how Sphinx makes the site; build.py calls it.
project = "armcal"
extensions = ["myst_parser"]
myst_heading_anchors = 4
root_doc = "README"
html_theme = "alabaster"
html_theme_options = {"description": "dynamic parameters of robot arms", "page_width": "1100px", "sidebar_width": "260px"}
html_show_sourcelink = False
html_show_copyright = False
html_copy_source = False
