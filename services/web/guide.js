'use strict';
// The page of a guided recording: takes the stream of news and shows the newest.
(() => {
  const { h } = Parts;
  const $ = id => document.getElementById(id);
  let shown = null, open = false;

  function connect() {
    const source = new EventSource('events');
    source.onopen = () => { open = true; pill(); };
    source.onerror = () => {
      open = false;
      pill();
      // A recording that has ended has no page any more; what it came to stays here.
      if (shown?.end.length) source.close();
      else if (source.readyState === EventSource.CLOSED) setTimeout(connect, 1500);
    };
    source.addEventListener('whole', event => take(JSON.parse(event.data).newest.guide));
    source.addEventListener('guide', event => take(JSON.parse(event.data)));
  }

  function pill() {
    const [tone, text] = shown?.end.length ? ['', 'the recording has ended'] : open ? ['good', 'recording'] : ['bad', 'connection lost, trying again'];
    $('link').textContent = text;
    $('link').className = 'pill' + (tone ? ' ' + tone : '');
  }

  // A large sentence begins with a capital letter.
  const capital = text => text.charAt(0).toUpperCase() + text.slice(1);

  function take(state) {
    if (!state) return;
    shown = state;
    pill();
    $('log').textContent = `${state.log} · ${state.seconds.toFixed(0)} s, ${state.rows.toLocaleString('en')} rows`;
    $('order').className = 'panel verdict ' + state.tone;
    $('order').replaceChildren(
      h('p.soft.small', state.end.length ? 'Result' : 'Do now'), h('h2', { id: 'now' }, capital(state.now)), h('p.hand', state.hand || '\u00a0'),
      h('.share', { role: 'progressbar', 'aria-valuenow': Math.round(100 * state.made), 'aria-valuemin': 0, 'aria-valuemax': 100, 'aria-label': 'of this manoeuvre' }, h('i', { style: `width:${100 * state.made}%` })),
      ...state.troubles.map(trouble => h('p.trouble', capital(trouble))));
    $('end').hidden = !state.end.length;
    $('end').replaceChildren(...state.end.map(says => (says.startsWith('next: ') ? Parts.command({ command: says.slice(6), says: '' }) : h('p', says))));
    if (!state.goals.length) return;
    const bar = goal => h('.share.' + goal.state.replace(' ', '-'), { title: goal.why || `${Math.floor(100 * goal.share)} % of the information` }, h('i', { style: `width:${100 * goal.share}%` }));
    const lacks = goal => (goal.state === 'gathering' ? `${Math.min(99, Math.floor(100 * goal.share))} %` : goal.state);
    $('goals').replaceChildren(h('h3', 'What the log is to tell'),
      h('.scroll', h('table.values.goals', h('thead', h('tr', ['axis', 'parameter', 'known by now', 'wanted', 'information', ''].map(t => h('th', t)))),
        h('tbody', state.goals.map(goal => h('tr', h('td', goal.axis), h('td', goal.name), h('td.number', goal.known), h('td.number', goal.needed), h('td', bar(goal)), h('td.number.lacks', lacks(goal))))))),
      ...state.goals.filter(goal => goal.why).map(goal => h('p.soft.small', `${goal.name} of axis ${goal.axis} is given up: ${goal.why}.`)),
      h('p.soft.small', 'Information: (standard error wanted ÷ standard error now)². It grows with the time of a motion that shows the parameter.'));
  }

  document.querySelector('.bar').append(Charts.themeButton());
  connect();
})();
