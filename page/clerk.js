'use strict';
// A worker with truerate in it, which answers its questions one after the other, and can be sent away at any time.
const Clerk = (() => {
  const packed = Uint8Array.from(atob(document.getElementById('wasm').textContent.trim()), c => c.charCodeAt(0));
  const script = URL.createObjectURL(new Blob([document.getElementById('worker').textContent], { type: 'text/javascript' }));

  // What a question comes to whose worker was sent away.
  class Ended extends Error {}

  // told(kind, text): 'progress', 'step' or 'failed', while something is asked. gone(): the worker ended by itself.
  function hire(told, gone = () => {}) {
    const own = new Worker(script);
    const waiting = new Map();
    let asked = 0, panicked = '', isHere = true;
    function fail(error) {
      for (const { failed } of waiting.values()) failed(error);
      waiting.clear();
    }
    function end() {
      own.terminate();
      isHere = false;
      fail(new Ended());
    }
    own.onmessage = ({ data: { kind, id, text, answer, advice, ended } }) => {
      if (!isHere) return;
      if (kind === 'panic') panicked = text;
      else if (kind !== 'answer' && kind !== 'refused') told(kind, text);
      else if (kind === 'answer') { waiting.get(id)?.done(answer); waiting.delete(id); } else {
        const why = panicked ? `the program has a mistake: ${panicked}` : ended ? `the log needs more memory than a page gets here (${text}): try the program on it` : text;
        const error = Object.assign(new Error(why), { advice });
        // Without a number it is the worker itself that did not start.
        if (waiting.has(id)) { waiting.get(id).failed(error); waiting.delete(id); } else fail(error);
        if (ended) { end(); gone(); }
      }
    };
    own.onerror = event => {
      if (!isHere) return;
      fail(new Error(`WebAssembly does not start in this browser: ${event.message}`));
      end();
      gone();
    };
    own.postMessage({ wasm: packed });
    const ask = (request, files) => new Promise((done, failed) => {
      if (!isHere) { failed(new Ended()); return; }
      waiting.set(++asked, { done, failed });
      own.postMessage({ id: asked, request, files });
    });
    return { ask, end };
  }

  return { hire, Ended };
})();
