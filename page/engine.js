'use strict';
// truerate as WebAssembly: bytes and JSON in, bytes and JSON out. The same in a worker and in Node.
class Engine {
  // told(kind, text): 'progress', 'step', 'failed' or 'panic', while something is asked.
  static async of(wasm, told) {
    const engine = new Engine();
    const kinds = ['progress', 'step', 'failed', 'panic'];
    const page = { told: (kind, at, length) => told(kinds[kind], engine.text(at, length)) };
    engine.call = (await WebAssembly.instantiate(wasm, { page })).instance.exports;
    return engine;
  }

  bytes(at, length) { return new Uint8Array(this.call.memory.buffer, at, length); }
  text(at, length) { return new TextDecoder().decode(this.bytes(at, length)); }

  // Copies bytes in.
  give(bytes) {
    const at = this.call.reserve(bytes.length);
    this.bytes(at, bytes.length).set(bytes);
    return [at, bytes.length];
  }
  say(text) { return this.give(new TextEncoder().encode(text)); }

  // Address in the low half, length in the high one.
  taken(place) { return [Number(place & 0xffffffffn), Number(place >> 32n & 0xffffffffn)]; }

  put(name, bytes) { this.call.put(...this.say(name), ...this.give(bytes)); }
  take(name) { return this.bytes(...this.taken(this.call.take(...this.say(name)))).slice(); }

  ask(request) {
    const answer = JSON.parse(this.text(...this.taken(this.call.ask(...this.say(JSON.stringify(request)), Date.now()))));
    if ('error' in answer) throw Object.assign(new Error(answer.error), { advice: answer.advice });
    return answer.ok;
  }
}
