// The line to the viewer: a websocket that comes back by itself.

const PAUSES = [500, 1000, 2000, 3000]; // ms between attempts

/**
 * Keep a line open for as long as the page lives.
 *
 * @param {object} on what to call: note(object), picture(info, blob), state(name, reason),
 *   name being "open", "away" or "gone"
 * @returns {{say: (order: object) => boolean}} say tells whether it was sent
 */
export function openLine(on) {
  let socket = null;
  let attempt = 0;
  let info = null;

  function connect() {
    const address = new URL("ws", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    socket = new WebSocket(address);
    socket.binaryType = "blob";
    socket.onopen = () => { attempt = 0; on.state("open", ""); };
    socket.onmessage = ({ data }) => hear(data);
    socket.onclose = ({ reason }) => { on.state("away", reason); retry(); };
  }

  function hear(data) {
    if (typeof data !== "string") on.picture(info, data);
    else {
      const news = JSON.parse(data);
      if (news.kind === "frame") info = news; // its picture follows at once
      else on.note(news);
    }
  }

  function retry() {
    const pause = PAUSES[Math.min(attempt++, PAUSES.length - 1)];
    setTimeout(async () => {
      // A refused websocket does not say why; a plain request does.
      const answer = await fetch("./", { cache: "no-store" }).catch(() => null);
      if (answer === null) retry();
      else if (answer.ok) connect();
      else on.state("gone", "");
    }, pause);
  }

  connect();
  return {
    say(order) {
      if (socket.readyState !== WebSocket.OPEN) return false;
      socket.send(JSON.stringify(order));
      return true;
    },
  };
}
