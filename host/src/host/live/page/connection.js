// The server's words: rows as binary, everything else as JSON. Comes back by itself.

const AGAIN_MS = 1000;

export function connect({ onHello, onRows, onState, onRecording, onClosed }) {
  const url = new URL("ws", location.href);
  url.protocol = "ws:";
  url.search = "";
  let socket = null;

  function open() {
    socket = new WebSocket(url);
    socket.binaryType = "arraybuffer";
    socket.onmessage = (event) => {
      if (typeof event.data !== "string") {
        onRows(new Float64Array(event.data));
        return;
      }
      const said = JSON.parse(event.data);
      if (said.type === "hello") onHello(said);
      else if (said.type === "state") onState(said);
      else if (said.type === "recording") onRecording(said);
    };
    socket.onclose = () => {
      onClosed();
      setTimeout(open, AGAIN_MS);
    };
  }

  open();
  return {
    mark() {
      this.ask({ type: "mark" });
    },
    ask(what) {
      if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(what));
    },
  };
}
