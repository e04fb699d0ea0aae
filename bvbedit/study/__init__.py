"""Studies: many materials by many configurations, measured, put into a table, and the table told.

Stands above fitting, rendering and recipes. Knows nothing of the command line, nor of the viewer.
"""
