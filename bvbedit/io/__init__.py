"""Files in and out, one module per format. Knows nothing of rendering or editing."""
