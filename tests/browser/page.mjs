// node page.mjs PAGE LOG JSON BROKEN SECOND TOGETHER PARQUET: the page in a browser, from disk with the network off: its example names what is hidden, a
// dropped log gets what the program says of it (JSON) and of two logs (TOGETHER), a broken one its error in words.
import { readFileSync } from 'node:fs';
import { check, finish, launch, looks, open, until } from './browser.mjs';

const [place, log, json, broken, second, together, parquet] = process.argv.slice(2);
const file = `file://${place}`;
const browser = await launch();
const { context, page, notes } = await open(browser, file);
page.on('worker', worker => check(worker.url().startsWith('blob:'), `a worker from ${worker.url()}`));
await context.setOffline(true);

const idle = seconds => until('the work ends', seconds, async () => !await page.locator('#work .working').count() && await page.locator('#saves button', { hasText: 'Save JSON' }).count());
const saved = async label => {
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: label }).click()]);
  return readFileSync(await download.path(), 'utf8');
};

// The example, to its end: the effect is named, added by click, and the error falls.
await page.goto(file);
await looks(page, 'page-start');
const documented = /truerate\.html(#example=[^`]*)`/.exec(readFileSync(new URL('../../docs/page.md', import.meta.url), 'utf8'))[1];
await page.goto(`${file}${documented}`);
await page.reload();
await until('the stages of the work', 20, async () => await page.locator('#work .stages li').count() === 4);
await idle(120);
check(/12\.\d+ ± .* ms late/.test(await page.locator('.verdict .answer').first().innerText()), `the example's answer is ${await page.locator('.verdict .answer').first().innerText()}`);
check(/delay: it is named/.test(await page.locator('.hidden-effect').innerText()), 'the hidden effect is not told');
await looks(page, 'page-example');
await page.locator('.model button[data-add=delay]').click();
await until('the error falls', 120, async () => /fell from .* times less/.test(await page.locator('.gain').innerText().catch(() => '')));
await idle(120);
check(await page.locator('.suspect').count() === 0, 'something is missing although the hidden effect was added');
check(await page.locator('.chart[aria-label^="Held-out"] .u-legend', { hasText: 'before' }).count() === 1, 'the curve before is not shown');
await looks(page, 'page-added');
check((await saved('Save model')).includes('delay.d'), 'the model that is saved has no delay');
check((await saved('Save C header')).includes('truerate_step'), 'the header that is saved has no step');
check((await saved('Save report')).includes('<!doctype html>'), 'the report that is saved is no page');
await page.locator('.chip button[data-remove=delay]').click();
await until('the error grows', 120, async () => /grew from/.test(await page.locator('.gain').innerText().catch(() => '')));
await idle(120);

// A log of its own: what the program says, to a millionth of a standard error.
await page.locator('#files').setInputFiles(log);
await until('the log is taken', 20, async () => (await page.locator('#log').innerText()).includes('log.csv'));
await idle(240);
const [ours, theirs] = [JSON.parse(await saved('Save JSON')), JSON.parse(readFileSync(json, 'utf8'))];
check(ours.axes.length === theirs.axes.length, 'not the same axes');
ours.axes.forEach((axis, k) => {
  const other = theirs.axes[k];
  const names = a => JSON.stringify([a.axis, a.verdict, a.finding.kind, a.suspects.map(s => [s.effect, s.aliases]), a.parameters.map(p => [p.effect, p.name])]);
  check(names(axis) === names(other), `the page says ${names(axis)}, the program ${names(other)}`);
  const all = a => [...a.parameters, ...a.suspects.flatMap(s => s.parameters)];
  all(axis).forEach((p, i) => {
    const q = all(other)[i];
    if (p.value == null || !q.std_error) return;
    const apart = Math.abs(p.value - q.value) / q.std_error;
    check(apart <= 1e-6, `${p.effect}.${p.name}: ${p.value} and ${q.value}, ${apart} standard errors apart`);
  });
});

// Work is ended by a click, and the page goes on after it.
await page.locator('.model select').first().selectOption('lag');
await page.getByRole('button', { name: 'Cancel' }).click();
check(/Cancelled/.test(await page.locator('#notice').innerText()), 'cancelling says nothing');
check(await page.locator('#work .working').count() === 0, 'work goes on after it was cancelled');
await page.locator('.model select').first().selectOption('lag');
await idle(240);
check(await page.locator('.chip button[data-remove=lag]').count() === 1, 'nothing can be done after cancelling');

// A broken file: its error, with line and column.
await page.locator('#files').setInputFiles(broken);
await until('the error', 30, async () => /broken\.csv line \d+ column \d+ \(gyro_x\)/.test(await page.locator('#notice').innerText()));

// Parquet, packed with zstd.
await page.locator('#files').setInputFiles(parquet);
await idle(60);
check(/2\.0 s at 100 Hz · 200 rows/.test(await page.locator('#about').innerText()), `of a Parquet the page says ${await page.locator('#about').innerText()}`);

// Foreign names: the channels are chosen by click.
await page.locator('#files').setInputFiles({ name: 'foreign.csv', mimeType: 'text/csv', buffer: Buffer.from(readFileSync(log, 'utf8').replace('gyro_x', 'w1').replace('ref_angle_x', 'q1')) });
await until('the table of channels', 60, async () => await page.locator('table.map tr').count() > 3);
const choose = (channel, name) => page.locator('table.map tr', { hasText: channel }).locator('select').first().selectOption(name);
await choose('w1', 'gyro_x');
await choose('q1', 'ref_angle_x');
await looks(page, 'page-channels');
await page.locator('#channels').getByRole('button', { name: 'Read it so' }).click();
await idle(240);
const chosen = JSON.parse(await saved('Save JSON'));
check(chosen.axes[0].verdict === theirs.axes[0].verdict, `with channels chosen by click: ${chosen.axes[0].verdict}`);

// Two logs at once: of one sensor, with one model; a log and the file with its reference, in either order.
const text = (name, of) => ({ name, mimeType: 'text/csv', buffer: Buffer.from(of) });
const lines = readFileSync(log, 'utf8').trim().split('\n').map(line => line.split(','));
const column = name => lines[0].indexOf(name);
const only = names => lines.map(line => names.map(name => line[column(name)]).join(',')).join('\n');
await page.locator('#files').setInputFiles([log, second]);
await until('both logs are taken', 60, async () => /2 logs of one sensor/.test(await page.locator('#about').innerText()));
await idle(240);
const [pooled, both] = [JSON.parse(await saved('Save JSON')), JSON.parse(readFileSync(together, 'utf8'))];
check(JSON.stringify(pooled.logs) === JSON.stringify(both.logs), `the page pools ${pooled.logs}, the program ${both.logs}`);
check(pooled.axes[0].verdict === both.axes[0].verdict && pooled.axes[0].suspects[0]?.effect === both.axes[0].suspects[0]?.effect, `of two logs the page says ${pooled.axes[0].verdict}, the program ${both.axes[0].verdict}`);
await looks(page, 'page-two-logs');
const apart = [text('reference.csv', only(['t', 'ref_angle_x'])), text('imu.csv', only(['t', 'gyro_x']))];
await page.locator('#files').setInputFiles(apart);
await until('the reference is joined', 60, async () => (await page.locator('#log').innerText()) === 'imu.csv + reference.csv');
await idle(240);
check(await page.locator('.verdict .answer').count() === 1, 'a log and its reference give no answer');

// What is shown as proof is one: the browser refuses to send.
await page.goto(file);
await page.reload();
notes.troubled = true;
await page.locator('#test-network').click();
await until('the proof', 20, async () => /refused it \(connect-src 'none'\)/.test(await page.locator('#test-result').innerText()));
await browser.close();
finish();
