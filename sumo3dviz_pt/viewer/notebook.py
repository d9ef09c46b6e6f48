"""The viewer beside a notebook's cell: it runs in threads of the notebook's own process."""

from __future__ import annotations

import atexit
import html

from sumo3dviz_pt.viewer.choices import Choices as Choices
from sumo3dviz_pt.viewer.render_thread import RenderThread
from sumo3dviz_pt.viewer.server import Server

_BELOW = 120
"""Height of what the page shows above and below the picture [px]."""

_NARROW = 960
"""Width at which pictures are shown, if the notebook is as wide [px]."""


class Viewer:
    """A viewer that runs until it is closed; notebooks show its page.

    Args:
        render_thread: What renders; it is started here.
        size: Of its pictures [px].
        choices: How it listens and looks.

    Attributes:
        address: Of the page, for a browser on this machine, or below the notebook's server.

    Raises:
        Sumo3dvizError: If the scene cannot be opened, or the port is taken.
    """

    def __init__(
        self, render_thread: RenderThread, *, size: tuple[int, int], choices: Choices | None = None
    ) -> None:
        choices = choices or Choices()
        self._height = choices.height or round(_NARROW * size[1] / size[0]) + _BELOW
        way = choices.way
        self._server = Server(
            render_thread, port=choices.port, token=choices.token, proxied=bool(way)
        )
        self._server.start()
        _, _, host, token, _ = self._server.address.split("/")
        self._port = host.rpartition(":")[2]
        below = way.replace("{port}", self._port).rstrip("/")
        self.address = f"{below}/{token}/" if way else self._server.address
        # Daemon threads that render while the interpreter goes away would crash it.
        atexit.register(self.close)

    @property
    def running(self) -> bool:
        """Whether the page is answered."""
        return self._server.running

    def close(self) -> None:
        """End it and free its memory; a second time does nothing."""
        self._server.close()
        atexit.unregister(self.close)

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<Viewer at {self.address}{'' if self.running else ', closed'}>"

    def _repr_html_(self) -> str:
        """Return a frame with the page, and its address for a window of its own."""
        if not self.running:
            return "<p>This viewer is closed; run the cell again to open one.</p>"
        address = html.escape(self.address, quote=True)
        return (
            f'<iframe src="{address}" title="Walk through the scene" width="100%"'
            f' height="{self._height}" style="border: 0"'
            ' allow="clipboard-write; fullscreen"></iframe>'
            f'<p><a href="{address}" target="_blank" rel="noopener">In a window of its own</a>.'
            " Nothing to see? The page lies on the machine that runs this notebook; from another"
            f" one, <code>ssh -L {self._port}:127.0.0.1:{self._port} ...</code> brings it, or"
            ' jupyter-server-proxy there and <code>proxy="/proxy/{port}/"</code> here.</p>'
        )
