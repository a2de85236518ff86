// node live.mjs URL PROGRAM INSTANCE [EFFECT]: the dashboard of a running pipeline. With EFFECT, which is hidden in its
// source, it is named, added, and taken back.
import { execFileSync } from 'node:child_process';
import { check, finish, launch, looks, open, picture, until } from './browser.mjs';

const [url, program, instance, effect] = process.argv.slice(2);
const browser = await launch();
const { page, notes } = await open(browser, url);
await page.goto(url);
const pill = () => page.locator('#link').innerText();
await until('samples on the page', 60, async () => await pill() === 'live');
await page.waitForSelector('#rate canvas');

const before = await picture(page, '#rate');
await page.waitForTimeout(1500);
check(await picture(page, '#rate') !== before, 'the chart of the rate does not move');
await until('parameters', 90, async () => await page.locator('#history canvas').count() > 0);
await until('processes', 30, async () => (await page.locator('#services tbody tr').count()) >= 4);
await until('latencies', 30, async () => (await page.locator('#stages .bars').count()) >= 4);

// Nothing is built anew that has not changed: a mark put on a row is still there after many updates.
await page.locator('#services tbody tr').first().evaluate(row => { row.marked = true; });
await page.waitForTimeout(1500);
check(await page.locator('#services tbody tr').first().evaluate(row => row.marked === true), 'rows are built anew at every update');

// One cursor over all charts of one quantity.
await page.locator('#rate').scrollIntoViewIfNeeded();
const over = await page.locator('#rate .u-over').boundingBox();
await page.mouse.move(over.x + 0.8 * over.width, over.y + over.height / 2);
const followed = chart => page.locator(chart).first().evaluate(c => (c.classList.contains('chart') ? c : c.querySelector('.chart')).classList.contains('hovered'));
for (const chart of ['#residual', '#history']) check(await until(`${chart} to follow the cursor over the rate`, 20, () => followed(chart)), `${chart} does not follow the cursor over the rate`);
await page.mouse.move(2, 2);

await page.locator('#rate').focus();
await page.keyboard.press('+');
check(await page.locator('#rate').evaluate(c => c.classList.contains('zoomed')), 'the key + does not zoom');
await page.keyboard.press('0');

// What is next to nothing is drawn too: uPlot alone looks for ever for the steps of such a grid.
const least = await page.evaluate(async () => {
  const place = document.body.appendChild(document.createElement('div'));
  const chart = Charts.make(place, { name: 'nothing', x: { label: 'τ', unit: 's', log: true }, y: { label: 'y', unit: '', log: true }, series: [{ label: 'y', ink: 'model' }], data: [[0.01, 0.1], [8.98e-22, 8.98e-22]] });
  await new Promise(requestAnimationFrame);
  const { min } = chart.u.scales.y;
  chart.destroy();
  place.remove();
  return min;
});
check(least > 0, `a logarithmic axis begins at ${least}`);

const model = await (await fetch(`${url}export/model.toml`)).text();
check(model.startsWith('schema = "truerate.model/1"'), `the model's export begins with ${model.slice(0, 60)}`);
const log = await (await fetch(`${url}export/log.csv`)).text();
check(/^t,.*gyro_/.test(log) && log.split('\n').length > 100, `the log's export begins with ${log.slice(0, 60)}`);

const order = (headers, body) => fetch(`${url}order`, { method: 'POST', headers: { 'content-type': 'application/json', ...headers }, body });
check((await order({ origin: 'http://evil.example' }, '{"do":"undo"}')).status === 403, 'a page of another origin may command');
for (const body of ['{"do":"save","argument":"../x.toml"}', '{"do":"explode"}', '[]', 'x', '{"do":"add","effect":"<b>","axis":"z"}']) {
  const { status } = await order({}, body);
  check(status >= 400 && status < 500, `${body} is answered with ${status}`);
}

if (effect) await theLoop();
await looks(page, 'dashboard');

// A dashboard that is killed is started again, and the open page finds it.
notes.troubled = true;
const status = JSON.parse(execFileSync(program, ['status', '--format', 'json', '--instance', instance]));
process.kill(status.services.find(s => s.name === 'dashboard').pid, 'SIGKILL');
await until('notice of the loss', 20, async () => (await pill()).startsWith('connection lost'));
await until('the page to find the new dashboard', 60, async () => await pill() === 'live');
notes.troubled = false;
await page.waitForTimeout(1000);
await browser.close();
finish();

async function theLoop() {
  const headline = () => page.locator('#verdict h2').innerText();
  // `27 × noise`.
  const ratio = async () => parseFloat(await page.locator('#verdict .figure .value').last().innerText().catch(() => 'NaN'));
  const chips = () => page.locator('#model .chip').allInnerTexts();
  const card = page.locator(`#suspects .suspect[data-effect="${effect}"]`);
  await until(`${effect} among the suspects`, 120, async () => await card.count() > 0);
  // A suspect may be listed while the motion so far hardly shows its error.
  await until('the error above its floor', 120, async () => await ratio() > 1.2);
  if (process.env.TRUERATE_SHOTS) await page.screenshot({ path: `${process.env.TRUERATE_SHOTS}/missing.png`, fullPage: true });
  await page.locator('#verdict').getByRole('button', { name: 'Add' }).click({ timeout: 120000 });
  await until(`${effect} in the model`, 60, async () => (await chips()).some(c => c.startsWith(effect)));
  await until('the error at its floor', 120, async () => await ratio() <= 1.2);
  await until('the picture of the trial', 30, async () => await page.locator('#trial canvas').count() > 0);
  const trial = await page.locator('#trial-says').innerText();
  check(trial.includes(effect) && trial.includes('took over'), `the trial says "${trial}"`);
  // The first line tells what was won; what was hidden stands below it, beside what was found.
  await until('what was won', 60, async () => /^\w[\w ]* added: [\d.]+ → [\d.]+ °\/s over /.test(await headline()));
  await until('what was hidden', 60, async () => new RegExp(`^Hidden was: ${effect} .*; found: .* ± `, 'm').test(await page.locator('#verdict').innerText()));
  if (process.env.TRUERATE_SHOTS) await page.screenshot({ path: `${process.env.TRUERATE_SHOTS}/added.png`, fullPage: true });
  await page.locator('#model').getByRole('button', { name: 'Undo' }).click();
  await until(`${effect} out of the model`, 60, async () => !(await chips()).some(c => c.startsWith(effect)));
  await until('the error back above its floor', 120, async () => await ratio() > 1.2);
  console.log(`named: ${await headline()}`);
}
