'use strict';
// The page: logs are dropped, judged in a worker, and the model changed by clicks. Nothing is sent to anybody.
(() => {
  const { h, panel } = Parts;
  const { number } = Charts;
  const at = id => document.getElementById(id);

  // ── The worker: one question at a time. ──

  const { Ended } = Clerk;
  let worker = null;

  const hears = (kind, text) => ({ progress, step: stepped, failed: text => notice('warn', h('p', text)) })[kind]?.(text);
  const hired = () => (worker ||= Clerk.hire(hears, end));

  function end() {
    worker?.end();
    worker = null;
    desk.isRead = false;
  }

  const ask = (request, files) => hired().ask(request, files);

  // ── What lies on the desk. ──

  let desk = { files: [] };

  // The same request as the program's flags.
  const reading = () => ({
    do: 'read', log: desk.log, more: desk.more || [], reference: desk.reference, dbc: desk.dbc, map: desk.map, axis: desk.axis || null,
    at_rest: desk.atRest || false, reference_is_dependent: desk.dependent || false,
  });

  // A worker that was ended has no log any more.
  async function onLog(request) {
    if (!desk.isRead) {
      desk.about = await ask(reading(), desk.files);
      desk.isRead = true;
    }
    return ask(request);
  }

  let doing = null;
  // What is wanted last counts: it ends what is under way.
  async function work(stages, task) {
    if (doing) end();
    const own = doing = { stages, stage: -1, since: performance.now(), text: '', steps: [] };
    document.body.classList.add('busy');
    at('notice').replaceChildren();
    own.clock = setInterval(draw, 250);
    draw();
    enable();
    try { await task(); } catch (error) {
      if (!(error instanceof Ended) && own === doing) await refused(error);
    } finally {
      clearInterval(own.clock);
      if (own === doing) { doing = null; draw(); enable(); }
    }
  }

  function stage(k) { if (doing) { doing.stage = k; doing.text = ''; draw(); } }
  function progress(text) { if (doing) { doing.text = text; draw(); } }
  function stepped(text) { if (doing) { doing.steps.push(text); draw(); } }

  function draw() {
    if (!doing) { at('work').replaceChildren(); return; }
    const seconds = (performance.now() - doing.since) / 1000;
    const text = doing.text && doing.text !== doing.stages[doing.stage]?.toLowerCase() ? doing.text : '';
    if (!at('work').firstChild) {
      at('work').append(h('section.panel.working', h('ul.stages'), h('.running', h('i')), h('span.soft.small.says'), h('button.cancel', { type: 'button', onclick: cancel }, 'Cancel'), h('ul.steps-taken')));
    }
    at('work').querySelector('.stages').replaceChildren(...doing.stages.map((name, k) => h('li' + (k < doing.stage ? '.done' : k === doing.stage ? '.now' : ''), name)));
    at('work').querySelector('.says').textContent = `${seconds.toFixed(seconds < 10 ? 1 : 0)} s${text ? ` · ${text}` : ''}`;
    at('work').querySelector('.steps-taken').replaceChildren(...doing.steps.map(step => h('li', step)));
  }

  function cancel() {
    doing = null;
    end();
    draw();
    enable();
    notice('', h('p', desk.view ? 'Cancelled. What is shown below is what was found before.' : 'Cancelled.'), desk.view ? null : h('.choices', h('button', { type: 'button', onclick: open }, 'Look at this log again')));
  }

  function notice(tone, ...content) { at('notice').replaceChildren(h('' + (tone ? '.' + tone : ''), content)); }

  function enable() { document.querySelectorAll('.change').forEach(button => { button.disabled = !!doing; }); if (!doing) document.body.classList.remove('busy'); }

  // ── Logs in. ──

  const ending = (file, list) => list.includes(file.name.toLowerCase().split('.').pop());

  // `second`: what is added belongs to the log that lies there.
  async function take(list, second) {
    const files = [...list];
    if (!files.length) return;
    if (doing) end();
    const read = [];
    for (const file of files) {
      try { read.push([file.name, await file.arrayBuffer()]); } catch (error) { notice('bad', h('p', `${file.name}: cannot be read: ${error.message}`)); return; }
    }
    const databases = read.filter((_, k) => ending(files[k], ['dbc']));
    const logs = read.filter((_, k) => !ending(files[k], ['dbc']));
    for (const [k, log] of logs.entries()) if (logs.slice(0, k).some(([name]) => name === log[0])) log[0] = `${k + 1}-${log[0]}`;
    const keeps = (second || !logs.length) && desk.log;
    if (keeps) {
      const names = [desk.log, logs.length ? null : desk.reference];
      const kept = desk.files.filter(([name]) => names.includes(name) || name === desk.dbc);
      if (logs[0] && logs[0][0] === desk.log) logs[0][0] = `reference-${logs[0][0]}`;
      desk = { ...fresh(), files: [...kept, ...read], log: desk.log, map: desk.map, reference: logs[0]?.[0] ?? desk.reference, dbc: databases[0]?.[0] ?? desk.dbc };
    } else {
      if (!logs.length) { notice('warn', h('p', 'A DBC file says what a CAN log means: drop the log with it.')); return; }
      desk = { ...fresh(), files: read, log: logs[0][0], dbc: databases[0]?.[0], others: logs.slice(1).map(([name]) => name) };
    }
    await open();
  }

  const fresh = () => ({ files: [], map: [], effects: {}, isRead: false });

  function clear() {
    Drive.end();
    Charts.clear();
    at('report').replaceChildren();
    at('channels').replaceChildren();
    Object.assign(desk, { view: null, model: null, before: null, html: null, isRead: false });
    header();
  }

  const STAGES = ['Reading the log', 'Fitting scale factor and bias', 'Looking for what is missing'];

  function open() {
    clear();
    small();
    return work(STAGES, async () => {
      stage(0);
      await readEither();
      await judge(1);
    });
  }

  // Of files that came together nobody said what each is. Files that are logs by themselves are logs of one sensor; of two others one has the
  // reference.
  async function readEither() {
    const others = desk.others || [];
    if (others.length) {
      const names = [desk.log, ...others];
      const ways = [{ log: names[0], more: others }];
      if (others.length === 1) ways.push({ log: names[0], reference: names[1] }, { log: names[1], reference: names[0] });
      let first;
      for (const way of ways) {
        Object.assign(desk, { more: [], reference: undefined }, way);
        try { desk.about = await ask(reading(), desk.files); first = null; break; } catch (error) {
          if (error instanceof Ended || !worker) throw error;
          // Of two files what the second one lacks as a reference tells more.
          if (!first || way.log === names[0]) first = error;
        }
      }
      if (first) { Object.assign(desk, { more: [] }, ways[1] || ways[0]); throw first; }
      desk.others = [];
    } else desk.about = await ask(reading(), desk.files);
    desk.isRead = true;
    header();
    small();
  }

  // The error first, which is quick, then what is behind it.
  async function judge(k) {
    stage(k);
    show(await onLog({ do: 'compare', model: desk.model || null }), true);
    stage(k + 1);
    show(await onLog({ do: 'diagnose', model: desk.model || null }));
    await keep();
  }

  async function keep() {
    desk.json = await onLog({ do: 'report', form: 'json' });
    desk.html = await onLog({ do: 'report', form: 'html' });
    header();
  }

  async function refused(error) {
    const { advice } = error;
    const said = h('pre', error.message);
    const choices = h('.choices');
    if (advice?.map.length && !advice.needs_file) choices.append(h('button.primary.change', { type: 'button', onclick: () => { desk.map = advice.map; open(); } }, `Read it so: ${advice.map.join(', ')}`));
    if (desk.log && !desk.view && !desk.reference && !desk.more?.length) choices.append(h('button.change', { type: 'button', onclick: () => pick(true) }, 'Add the file with the reference…'));
    notice('bad', said, choices);
    if (desk.log && !desk.view && worker) await channels(advice?.map);
  }

  // ── Channels by click. ──

  const NAMES = [
    ['', 'not used'], ['t', 'time'],
    ...['x', 'y', 'z'].map(a => [`gyro_${a}`, `gyro ${a}`]),
    ...['x', 'y', 'z'].map(a => [`ref_angle_${a}`, `reference angle ${a}`]),
    ...['x', 'y', 'z'].map(a => [`ref_rate_${a}`, `reference rate ${a}`]),
    ['ref_q', 'reference orientation'],
    ...['x', 'y', 'z'].map(a => [`accel_${a}`, `accelerometer ${a}`]),
    ['temp', 'temperature'], ['supply', 'supply voltage'],
  ];
  const FACTORS = [['', 'as it is: SI, or its own unit'], ['0.017453292519943295', 'degrees'], ['6.283185307179586', 'turns'], ['0.001', '× 0.001'], ['0.000001', '× 0.000001'], ['9.80665', 'g'], ['-1', '× −1'], ['own', 'another factor…']];
  const select = (options, value) => { const node = h('select.change', options.map(([v, label]) => h('option', { value: v }, label))); node.value = value; return node; };

  async function channels(map) {
    const place = at('channels');
    const looks = [];
    for (const [name, of] of [[desk.log, ''], [desk.reference, 'ref:']].filter(([name]) => name)) {
      try { looks.push([name, of, await ask({ do: 'look', log: name, dbc: desk.dbc || null }, desk.files)]); } catch (error) { if (error instanceof Ended) return; }
    }
    if (!looks.length) return;
    const rows = [];
    const table = ([name, of, look]) => {
      const given = map?.length ? map : desk.map.length ? desk.map : [...look.map, ...look.likely];
      const body = look.channels.map(channel => {
        // A flag that names this channel, with whatever stands around it.
        const own = given.map(flag => flag.split(/=(.*)/s)).find(([, right]) => right && right.split(/[*/+]/).some(part => part.trim().replace(/^-/, '') === channel.channel) || right === channel.channel);
        const isOwn = look.own.includes(channel.channel);
        const ours = own ? own[0].replace(/^ref:/, '') : '';
        const names = NAMES.some(([v]) => v === ours) ? NAMES : [...NAMES, [ours, ours]];
        const use = isOwn ? null : select(names, ours);
        const custom = own && own[1] !== channel.channel;
        const factor = isOwn ? null : select(custom ? [['given', own[1]], ...FACTORS] : FACTORS, custom ? 'given' : '');
        const typed = h('input.factor', { placeholder: 'factor', inputmode: 'decimal', hidden: '' });
        if (factor) factor.onchange = () => { typed.hidden = factor.value !== 'own'; };
        const row = h('tr' + (ours || isOwn ? '.used' : ''), h('td', h('code', channel.channel)), h('td.number', channel.unit || ''), h('td.number', String(channel.values)), h('td.number', channel.rate_hz ? `${channel.rate_hz.toFixed(1)} Hz` : ''), h('td.number', `${number(channel.min)} … ${number(channel.max)}`), h('td', isOwn ? h('span.soft', 'by its name') : use), h('td', factor, typed));
        if (use) { use.onchange = () => row.classList.toggle('used', !!use.value); rows.push({ of, channel: channel.channel, use, factor, typed, given: own?.[1] }); }
        return row;
      });
      return [h('p', h('b', name), h('span.soft', ` · ${look.format}`)), h('.scroll', h('table.values.map', h('thead', h('tr', ['channel', 'unit', 'values', 'rate', 'from … to', 'is the', 'in the file it is in'].map(t => h('th', t)))), h('tbody', body))), look.notes.length ? Parts.list(look.notes) : null];
    };
    const tables = looks.map(table);
    const rest = h('input', { type: 'checkbox' }), dependent = h('input', { type: 'checkbox' });
    [rest.checked, dependent.checked] = [!!desk.atRest, !!desk.dependent];
    const axis = select([['', 'all axes'], ['x', 'axis x'], ['y', 'axis y'], ['z', 'axis z']], desk.axis || '');
    const read = () => {
      desk.map = rows.filter(row => row.use.value).map(({ of, channel, use, factor, typed, given }) => {
        const second = of && use.value.startsWith('ref_') ? of : '';
        const times = factor.value === 'own' ? typed.value.trim().replace(',', '.') : factor.value;
        return `${second}${use.value}=${factor.value === 'given' ? given : times ? `${times}*${channel}` : channel}`;
      });
      Object.assign(desk, { atRest: rest.checked, dependent: dependent.checked, axis: axis.value });
      open();
    };
    place.replaceChildren(h('.grid', panel('', 'Which channel is what', ...tables,
      h('.choices', axis, h('label.small', rest, ' axes without a reference did not turn'), h('label.small', dependent, ' use the reference even if it was computed from this gyro')),
      h('.choices', h('button.primary.change', { type: 'button', onclick: read }, 'Read it so'), h('button', { type: 'button', onclick: () => place.replaceChildren() }, 'Close')))));
  }

  // ── Results. ──

  const judged = axis => axis.curves[axis.judged];

  // What was found; `early` while more is looked for.
  function show(found, early) {
    Object.assign(desk, { view: found.view, effects: found.effects, isEarly: !!early });
    desk.fitted = found.model;
    lay();
  }

  function lay() {
    const place = at('report');
    const tab = place.querySelector('.tab[aria-selected=true]');
    const shown = tab ? tab.textContent.trim()[5] : undefined;
    place.style.minHeight = `${place.offsetHeight}px`;
    Charts.clear();
    place.replaceChildren();
    const view = structuredClone(desk.view);
    for (const axis of view.axes) {
      const before = desk.before?.[axis.axis];
      if (before?.curve && !axis.steps.length) { axis.curves.unshift({ ...before.curve, label: 'before' }); axis.judged += 1; }
    }
    if (desk.isEarly) place.append(h('p.soft.small', 'The error is known already; what is behind it is being looked for.'));
    Report.lay(view, place, { axis: model, suspect: (axis, suspect) => adding(axis, suspect.effect), shown });
    place.style.minHeight = '';
    enable();
    header();
  }

  const adding = (axis, effect, primary) => h('button.change' + (primary ? '.primary' : ''), { type: 'button', 'data-add': effect, onclick: () => change([{ axis: axis.axis, effect, add: true }], `${effect} added`) }, primary ? `Add ${effect}` : 'Add');

  // What the model of an axis has, and what can be done with it.
  function model(axis) {
    const has = desk.effects[axis.axis] || axis.effects.map(card => card.id);
    const fixed = ['scale-factor', 'bias'];
    const chips = has.map(id => h('span.chip' + (fixed.includes(id) ? '.fixed' : ''), id, fixed.includes(id) ? null : h('button.change', { type: 'button', 'data-remove': id, title: `Remove ${id}`, 'aria-label': `Remove ${id}`, onclick: () => change([{ axis: axis.axis, effect: id, add: false }], `${id} removed`) }, '✕')));
    const missing = !desk.isEarly && axis.suspects.length && ['missing-effect', 'ambiguous'].includes(axis.verdict);
    const more = select([['', 'Add another effect…'], ...catalogue.filter(card => !has.includes(card.id)).map(card => [card.id, `${card.id}: ${card.title}`])], '');
    more.onchange = () => { if (more.value) change([{ axis: axis.axis, effect: more.value, add: true }], `${more.value} added`); };
    return h('.model.screen', gain(axis), answerOfExample(axis),
      h('.chips', h('span.soft.small', 'Model: '), chips),
      h('.choices', missing ? adding(axis, axis.suspects[0].effect, true) : null, missing ? h('button.change', { type: 'button', onclick: climb }, 'Add until nothing is missing') : null, catalogue.length ? more : null));
  }

  // By how much the error fell, where that is largest.
  function gain(axis) {
    const before = desk.before?.[axis.axis], now = judged(axis);
    if (!before?.curve || !now) return null;
    const points = now.tau.map((tau, i) => {
      const k = before.curve.tau.findIndex(t => Math.abs(t / tau - 1) < 1e-6);
      return { tau, now: now.error[i], was: k < 0 ? null : before.curve.error[k] };
    }).filter(p => p.now > 0 && p.was > 0);
    if (!points.length) return null;
    const best = points.reduce((a, b) => (Math.abs(Math.log(b.was / b.now)) > Math.abs(Math.log(a.was / a.now)) ? b : a));
    const times = best.was / best.now, over = `over ${Charts.seconds(best.tau)} s`, from = `from ${number(best.was)} to ${number(best.now)} °/s`;
    const size = Math.abs(Math.log(times)) < 0.02 ? `the error stays as it was (${number(best.now)} °/s ${over})` : times > 1 ? `the error ${over} fell ${from}, ${times < 1.5 ? `${Math.round(100 * (1 - 1 / times))} % less` : `${number(times)} times less`}` : `the error ${over} grew ${from}`;
    const floor = before.ratio != null && axis.error_over_floor != null ? `; at its worst it was ${number(before.ratio)} × the floor of noise and is ${number(axis.error_over_floor)} ×` : '';
    return h('p.gain' + (times < 0.98 ? '.worse' : ''), `${desk.did[0].toUpperCase()}${desk.did.slice(1)}: ${size}${floor}.`);
  }

  function remember() {
    desk.before = Object.fromEntries(desk.view.axes.map(axis => [axis.axis, { curve: judged(axis), ratio: axis.error_over_floor }]));
  }

  function change(edits, did) {
    return work([did.endsWith('added') ? 'Adding and refitting' : 'Removing and refitting', 'Looking for what is missing'], async () => {
      stage(0);
      const changed = await onLog({ do: 'change', model: desk.model || null, edits });
      remember();
      desk.did = did;
      desk.model = changed.model;
      show(changed, true);
      stage(1);
      show(await onLog({ do: 'diagnose', model: desk.model }));
      await keep();
    });
  }

  function climb() {
    return work(['Adding what is missing, step by step'], async () => {
      stage(0);
      const found = await onLog({ do: 'ladder', model: desk.model || null });
      remember();
      const added = Object.entries(found.effects).flatMap(([axis, ids]) => ids.filter(id => !(desk.effects[axis] || []).includes(id)));
      desk.did = added.length ? `${[...new Set(added)].join(', ')} added` : 'nothing added';
      desk.model = found.model;
      show(found);
      await keep();
    });
  }

  // ── The example. ──

  const HIDDEN = ['delay:d=0.012', 'temperature-bias', 'encoder-eccentricity', 'scale-asymmetry', 'lag', 'warm-up'];

  async function example(hide, seed) {
    const random = crypto.getRandomValues(new Uint32Array(2));
    hide ||= HIDDEN[random[0] % HIDDEN.length];
    seed ??= random[1] % 10000;
    desk = { ...fresh(), log: 'example.csv', hidden: hide.split(':')[0] };
    clear();
    small();
    await work(['Simulating a log', ...STAGES], async () => {
      stage(0);
      await ask({ do: 'simulate', log: 'example.csv', hide: [hide], seconds: 120, rate: 100, seed });
      desk.files = [['example.csv', (await ask({ do: 'take', log: 'example.csv' })).buffer]];
      stage(1);
      await readEither();
      await judge(2);
    });
  }

  function answerOfExample(axis) {
    if (!desk.hidden || desk.isEarly || axis.axis !== 'x') return null;
    const group = axis.suspects.slice(0, 1).flatMap(s => [s.effect, ...s.aliases.map(a => a.id)]);
    const has = desk.effects.x || [];
    const named = group.includes(desk.hidden) || has.includes(desk.hidden);
    return h('p.soft.small.hidden-effect', 'In this example the simulator had hidden ', h('b', desk.hidden), named ? ': it is named.' : ': it is not named.');
  }

  // ── The vehicle. ──

  function drive(hide, seed) {
    if (doing) cancel();
    end();
    desk = fresh();
    clear();
    at('notice').replaceChildren();
    at('start').replaceChildren();
    seed ??= crypto.getRandomValues(new Uint32Array(1))[0] % 10000;
    Drive.begin({ hide, seed, save, again: () => drive(), leave: () => { large(); header(); } });
    header();
  }

  // ── The frame around it. ──

  const chooser = h('input', { type: 'file', multiple: '', hidden: '', id: 'files' });
  let chooseSecond = false;
  chooser.onchange = () => { const list = [...chooser.files]; chooser.value = ''; take(list, chooseSecond); };
  const pick = second => { chooseSecond = second; chooser.click(); };

  function header() {
    at('log').textContent = Drive.runs() ? `Vehicle ${Drive.runs().seed} drives in this page, with an effect hidden in its gyro` : desk.log ? [desk.log, ...(desk.more || []), desk.reference].filter(Boolean).join(' + ') : 'What is wrong with a gyro, and which physics its model lacks';
    at('about').textContent = desk.log && desk.about ? desk.about.about.slice(0, -1).join(' · ') : '';
    const name = (desk.log || 'log').replace(/(\.csv|\.txt)?(\.gz)?$/, '');
    const button = (label, action) => h('button', { type: 'button', onclick: action }, label);
    at('saves').replaceChildren(...[
      desk.html ? button('Save report', () => save(`${name}.html`, desk.html, 'text/html')) : null,
      desk.html ? button('Save JSON', () => save(`${name}.json`, desk.json, 'application/json')) : null,
      desk.html && desk.fitted ? button('Save model', () => save('model.toml', desk.fitted, 'application/toml')) : null,
      desk.html && desk.fitted ? button('Save C header', header_c) : null,
      theme,
    ].filter(Boolean));
  }

  function header_c() {
    return work(['Writing the C header'], async () => {
      stage(0);
      const { text, warnings } = await onLog({ do: 'export', model: desk.fitted, name: 'model.toml', to: 'c' });
      save('gyro_model.h', text, 'text/x-c');
      if (warnings.length) notice('warn', Parts.list(warnings));
    });
  }

  function save(name, content, type) {
    const link = h('a', { href: URL.createObjectURL(new Blob([content], { type })), download: name });
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  const openButton = primary => h('button' + (primary ? '.primary.large' : ''), { type: 'button', onclick: () => pick(false) }, primary ? 'Open a log…' : 'Another log…');
  const exampleButton = large => h('button' + (large ? '.large' : ''), { type: 'button', id: 'example', onclick: () => example() }, large ? 'Try an example' : 'Another example');

  const driveButton = large => h('button' + (large ? '.large' : ''), { type: 'button', id: 'drive-demo', onclick: () => drive() }, large ? 'Drive the demo' : 'Another vehicle');

  function large() {
    at('start').replaceChildren(h('.drop', h('h2', 'Open a log of a gyro and its reference, or drop it here'),
      h('p', 'The page says how wrong the gyro is, which physical effect its model is missing, and how much of the error goes away with it. A log is a CSV or Parquet file, ULog, ArduPilot .bin, MCAP, ROS bag or CAN log. The reference is what knows the true motion: a shaft encoder, a rate table, motion capture or an orientation, in the same file or in a second one. Several logs of one sensor are judged together, with one model.'),
      h('.choices', openButton(true), exampleButton(true), driveButton(true)),
      h('p.soft.small', 'The example is a log that is simulated here, with a hidden effect for you to find. In the demo a vehicle drives while you watch.')),
    h('.three', step('1', 'Open a log', 'The log is read and checked: units, axes, gaps, faulty rows. Where names are not clear, you choose the channels by click.'),
      step('2', 'Read the verdict', 'The error is held against the floor that noise alone leaves. What is above it is missing physics, and the page says which.'),
      step('3', 'Add the effect', 'Watch the error fall. Save the model, a C header for your firmware, or the report.')), kept());
  }
  const step = (k, title, text) => h('section.panel', h('h3', `${k}. ${title}`), h('p', text));

  // What shows that nothing leaves this machine: the browser itself.
  function kept() {
    const says = h('p.small', { id: 'test-result' });
    const test = h('button', { type: 'button', id: 'test-network', onclick: () => {
      let refusedBy = '';
      const hears = event => { refusedBy = event.effectiveDirective; };
      document.addEventListener('securitypolicyviolation', hears);
      const tell = text => setTimeout(() => { document.removeEventListener('securitypolicyviolation', hears); says.textContent = refusedBy ? `The browser refused it (${refusedBy} 'none'): the page tried to send one word to another address.` : text; }, 100);
      fetch('https://example.invalid/word').then(() => tell('It was sent: this copy of the page is not the original one. Do not use it.'), () => tell('It failed, but not by the rule of this page: do not rely on it.'));
    } }, 'Let the page try to send something');
    return h('.grid', panel('', 'Nothing leaves this machine', h('p', 'Your log stays in this tab. The page is one file without a server: save it, switch the network off, and it works all the same. One of its first lines forbids every connection (', h('code', "default-src 'none'"), '), and your browser enforces it.'), h('.choices', test), says));
  }

  function small() {
    at('start').replaceChildren(h('.drop.small', h('p.soft.small', 'Drop another log here; it stays on this machine.'),
      h('.choices', openButton(false), desk.hidden ? exampleButton(false) : null, desk.hidden && desk.files.length ? h('button', { type: 'button', onclick: () => save('example.csv', desk.files[0][1], 'text/csv') }, 'Save the example') : null,
        desk.hidden || desk.more?.length ? null : h('button', { type: 'button', onclick: () => pick(true) }, desk.reference ? 'Another reference…' : 'Add a reference…'),
        h('button.change', { type: 'button', id: 'show-channels', onclick: () => work(['Looking at the channels'], async () => { stage(0); await channels(); }) }, 'Channels…'))));
  }

  let catalogue = [];
  const theme = Charts.themeButton();
  document.body.append(chooser);
  large();
  header();
  let over = 0;
  const drags = (name, act) => addEventListener(name, event => { event.preventDefault(); act(event); });
  drags('dragenter', () => { over += 1; document.body.classList.add('over'); });
  drags('dragleave', () => { over -= 1; if (!over) document.body.classList.remove('over'); });
  drags('dragover', () => {});
  drags('drop', event => { over = 0; document.body.classList.remove('over'); const { files } = event.dataTransfer; take(files, desk.log && !desk.view && !desk.reference && files.length === 1 && at('notice').firstChild); });

  // `#example=EFFECT,SEED` opens that example, `#demo=EFFECT,SEED` drives that vehicle.
  const wanted = decodeURIComponent(location.hash).match(/^#(example|demo)(?:=([a-z][a-z-]*(?::.*?)?)(?:,(\d+))?|=(\d+))?$/);
  const begin = { example, demo: drive };
  ask({ do: 'effects' }).then(cards => { catalogue = cards; if (wanted) begin[wanted[1]](wanted[2], [wanted[3], wanted[4]].filter(Boolean).map(Number)[0]); }, error => notice('bad', h('p', error.message)));
})();
