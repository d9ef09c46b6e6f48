"""Walking through a scene in the browser: server, page, camera, key frames."""
