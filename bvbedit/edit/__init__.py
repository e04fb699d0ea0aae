"""Editing a material: what can be done to a model, told in words, undone, recorded and played again.

Knows models, files and pictures of numbers; not how anything looks on a screen or in a scene.
"""
