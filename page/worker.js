// Works on one log, away from the page, which stays quick and can end it at any time.
let engine;
const serve = async ({ id, wasm, files, request }) => {
  try {
    if (wasm) {
      const unpacked = new Blob([wasm]).stream().pipeThrough(new DecompressionStream('gzip'));
      engine = await Engine.of(await new Response(unpacked).arrayBuffer(), (kind, text) => postMessage({ kind, text }));
      return;
    }
    for (const [name, bytes] of files || []) engine.put(name, new Uint8Array(bytes));
    const answer = request.do === 'take' ? engine.take(request.log) : engine.ask(request);
    postMessage({ kind: 'answer', id, answer });
  } catch (error) {
    postMessage({ kind: 'refused', id, text: error.message, advice: error.advice, ended: error instanceof WebAssembly.RuntimeError || error instanceof RangeError });
  }
};
// One after the other: the first message brings the program itself.
let line = Promise.resolve();
onmessage = ({ data }) => { line = line.then(() => serve(data)); };
