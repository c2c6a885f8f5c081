"""The main job in a browser: a local web application on 127.0.0.1 (docs/studio.md)."""
