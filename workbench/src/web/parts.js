'use strict';
// Parts of a page that the report and the dashboard share. All text goes in as text, never as markup.
const Parts = (() => {
  // h('p.soft', { title: '…' }, 'text', node, …)
  function h(tag, ...rest) {
    const [name, ...classes] = tag.split('.');
    const node = document.createElement(name || 'div');
    if (classes.length) node.className = classes.join(' ');
    for (const part of rest.flat(Infinity)) {
      if (part == null || part === false) continue;
      if (part instanceof Node) node.append(part);
      else if (typeof part === 'object') for (const [k, v] of Object.entries(part)) { if (k.startsWith('on')) node.addEventListener(k.slice(2), v); else if (v != null) node.setAttribute(k, v); }
      else node.append(String(part));
    }
    return node;
  }

  // A sentence in which `commands` stand.
  const prose = text => text.split('`').map((part, k) => (k % 2 ? h('code', part) : part));

  // The answer in the page's largest words, what to do about it on the vehicle, and the verdict's own sentence.
  const answer = view => [h('h2.answer', view.headline), view.at_source ? h('p', h('b', 'At the source: '), `${view.at_source}.`) : null, h('p.soft.small', h('b', `${view.label[0].toUpperCase()}${view.label.slice(1)}. `), Parts.prose(view.says))];

  const panel = (size, heading, ...content) => h('section.panel' + (size ? '.' + size : ''), heading ? h('h3', heading) : null, ...content);

  function copyButton(text) {
    const button = h('button', { type: 'button' }, 'Copy');
    button.addEventListener('click', async () => {
      try { await navigator.clipboard.writeText(text); } catch {
        const area = h('textarea'); area.value = text; document.body.append(area); area.select(); document.execCommand('copy'); area.remove();
      }
      button.textContent = 'Copied';
      setTimeout(() => { button.textContent = 'Copy'; }, 1500);
    });
    return button;
  }

  const command = next => h('', h('.command', h('code', next.command), copyButton(next.command)), h('p.soft.small', prose(next.says)));

  function card(c) {
    const rows = [['physics', c.physics], ['equation', c.equation], ['typical size', c.typical], ['shown by', c.excited_by], ['correction', c.mended_by], ['source', c.source]];
    return h('details', h('summary', `What ${c.id} is`), h('dl', rows.filter(r => r[1]).map(([k, v]) => [h('dt', k), h('dd', k === 'equation' ? h('code', v) : v)])));
  }

  function parameters(list, withEffect) {
    if (!list.length) return h('p.soft', 'No parameters yet.');
    return h('.scroll', h('table.values',
      h('thead', h('tr', withEffect ? h('th', 'effect') : null, h('th', ''), h('th', 'value ± standard error'), h('th.says', ''), h('th.says', 'usual on low-cost sensors'))),
      h('tbody', list.map(p => h('tr', withEffect ? h('td', p.effect) : null, h('td', h('code', p.name)), h('td.number', p.shown), h('td.soft.says', p.says), h('td.soft.says', p.typical || ''))))));
  }

  // extra: nodes behind the title (the dashboard's Add button)
  function suspect(s, extra) {
    return h('article.suspect', { 'data-effect': s.effect },
      h('.head', h('b', s.effect), h('span.soft', s.card.title), extra || null),
      h('.share', { title: `removes ${s.removes} of the excess error` }, h('i', { style: `width:${100 * (s.share ?? 0)}%` })),
      h('p.small', `removes ${s.removes} of the excess error`, s.significance ? `, ${s.significance}` : ''),
      s.odds ? h('p.soft.small', `Odds against the next suspect: ${s.odds}.`) : null,
      s.parameters.length ? h('p.number', s.parameters.map(p => h('', `${p.name}${/^not /.test(p.shown) ? ':' : ' ='} ${p.shown}`))) : null,
      s.card.typical ? h('p.soft.small', `Usual: ${s.card.typical}.`) : null,
      s.aliases.map(a => h('.alias', h('p', `Here it cannot be told from `, h('b', a.id), a.title ? ` (${a.title})` : '', '.'), a.when ? h('p.soft.small', `They look alike when ${a.when}.`) : null, a.split_by ? h('p.small', `To tell them apart: ${a.split_by}.`) : null)),
      s.aliases.length && s.separate_by ? h('p', h('b', 'Manoeuvre: '), s.separate_by) : null,
      card(s.card));
  }

  // Bars on a logarithmic scale of error/floor; a stub is left at the floor.
  function steps(list) {
    const most = Math.max(2, ...list.map(s => s.ratio ?? 1));
    const wide = r => (r == null ? 0 : 4 + 96 * Math.log(Math.max(1, r)) / Math.log(most));
    return h('.steps', list.map(s => [
      h('.label', s.label, s.aliases.length ? h('span.or.soft.small', `or ${s.aliases.join(' or ')}`) : null),
      h('.number', s.ratio == null ? '–' : `${Charts.number(s.ratio)} × floor`),
      s.won ? h('.won.good.small', s.won) : null,
      h('.fall', { title: `error ÷ floor at its worst ${Charts.number(s.ratio)}` + (s.error_1s != null ? `, ${Charts.number(s.error_1s)} °/s at 1 s` : '') }, h('i' + (s.ratio != null && s.ratio < 1.35 ? '.floor' : ''), { style: `width:${wide(s.ratio)}%` })),
    ]));
  }

  // Several axes: what they share, and a table of what each has.
  function story(s) {
    return [
      s.shared.map(shared => [h('h2.answer', shared.says), shared.at_source ? h('p', h('b', 'At the source: '), `${shared.at_source.replace(/\.$/, '')}.`) : null]),
      h('.scroll', h('table.values.story', h('thead', h('tr', s.head.map(head => h('th', head)))),
        h('tbody', s.rows.map(r => h('tr' + (r.tone ? '.' + r.tone : ''), h('td', r.axis), h('td', h('b', r.cells[0])), h('td.number', r.cells[1]), h('td.number' + (r.won ? '.won' : ''), r.cells[2])))))),
    ];
  }

  // One of several places at a time; on paper all of them. tabs: [{ label, says, tone, place }]
  function tabs(list) {
    const buttons = list.map((tab, i) => h('button.tab.' + tab.tone, { type: 'button', role: 'tab', id: 'tab-' + i, onclick: () => show(i) }, h('b', tab.label), h('span.soft', ` ${tab.says}`)));
    const show = at => list.forEach((tab, i) => {
      tab.place.classList.toggle('away', i !== at);
      buttons[i].setAttribute('aria-selected', i === at);
      buttons[i].tabIndex = i === at ? 0 : -1;
    });
    list.forEach((tab, i) => { tab.place.setAttribute('role', 'tabpanel'); tab.place.setAttribute('aria-labelledby', 'tab-' + i); });
    const bar = h('.tabs.screen', { role: 'tablist', onkeydown: event => {
      const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
      if (!step) return;
      const next = (buttons.indexOf(document.activeElement) + step + buttons.length) % buttons.length;
      show(next);
      buttons[next].focus();
      event.preventDefault();
    } }, buttons);
    bar.show = show;
    return bar;
  }

  const list = items => h('ul.plain', items.map(i => h('li', i)));

  return { h, panel, prose, answer, command, card, parameters, suspect, steps, story, tabs, list, copyButton };
})();
