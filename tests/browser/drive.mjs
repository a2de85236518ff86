// node drive.mjs PAGE: the demo of the page, from disk with the network off: a vehicle drives, what is hidden is named, added by click,
// the error falls, and the page says what was hidden, what was found and what was won.
import { readFileSync } from 'node:fs';
import { check, finish, launch, looks, open, picture, until } from './browser.mjs';

const [place] = process.argv.slice(2);
const file = `file://${place}`;
const browser = await launch();
const { context, page } = await open(browser, file);
await context.setOffline(true);
const verdict = () => page.locator('#drive .verdict').innerText();
const seconds = async () => +((await page.locator('.driving .pill').innerText()).match(/(\d+) s/)?.[1] ?? 0);

// From the first screen.
await page.goto(file);
await page.getByRole('button', { name: 'Drive the demo' }).click();
await until('a vehicle drives', 60, async () => await seconds() > 2);
await until('its motion is drawn', 20, async () => await page.locator('[aria-label^="Rate over"] canvas').count() === 1);
const first = await picture(page, '[aria-label^="Rate over"]');
await until('the motion moves', 10, async () => await picture(page, '[aria-label^="Rate over"]') !== first);
check(/Which one\?|Looking|So far/.test(await verdict()), `what is hidden is told too early: ${await verdict()}`);
await page.getByRole('button', { name: 'Pause' }).click();
const stood = await until('it stands', 10, async () => { const [a, b] = [await seconds(), (await page.waitForTimeout(600), await seconds())]; return a === b && a; });
await page.getByRole('button', { name: 'Drive on' }).click();
await until('it drives on', 10, async () => await seconds() > stood);
await page.getByRole('button', { name: 'Leave' }).click();
check(await page.locator('#drive > *').count() === 0 && await page.locator('#drive-demo').count() === 1, 'leaving the demo does not lead to the first screen');

// One that is chosen: 12 ms.
await page.goto(`${file}#demo=delay:d=0.012,7`);
await page.reload();
await page.locator('#drive button', { hasText: '16 ×' }).click();
await until('the name', 240, async () => await page.locator('#drive .verdict button[data-add=delay]').count() === 1);
check(/ms late/.test(await verdict()), `the answer is ${await verdict()}`);
check(!/hidden was/i.test(await verdict()), 'what was hidden is told before anybody asked');
check(await page.locator('[aria-label^="Error of the rate"] canvas').count() === 1, 'the error over time is not drawn');
await looks(page, 'drive-named');
const figure = async of => +((await page.locator('#drive .figure', { hasText: of }).first().locator('.value').innerText()).match(/[\d.]+/)[0]);
const before = await figure(/error at (1|1\.\d+|0\.9\d*) s/);
await page.locator('#drive .verdict button[data-add=delay]').click();
await until('what was won', 120, async () => /Delay added: .* → .* °\/s over [\d.]+ s/.test(await verdict()));
const found = (await verdict()).match(/Hidden was: delay 12 ms; found: ([\d.]+) ± ([\d.]+) ms/);
check(found && Math.abs(found[1] - 12) < Math.max(5 * found[2], 0.05), `what was hidden and found: ${await verdict()}`);
const after = await figure(/error at (1|1\.\d+|0\.9\d*) s/);
check(after < before / 5, `the error over 1 s was ${before} and is ${after} °/s`);
// Only a simulation knows it: the rate itself.
const truth = await until('the true error', 60, async () => (await verdict()).match(/True error of the rate over 1 s: ([\d.]+) °\/s before, ([\d.]+) °\/s now/));
check(truth && truth[2] < truth[1] / 5, `the true error: ${truth?.[0]}`);
await until('the searches after it find nothing', 240, async () => /noise/.test(await verdict()) && await page.locator('#drive .suspect').count() === 0);
await looks(page, 'drive-added');
const [download] = await Promise.all([page.waitForEvent('download'), page.locator('#drive button', { hasText: 'Save model' }).click()]);
check(readFileSync(await download.path(), 'utf8').includes('delay.d'), 'the model that is saved has no delay');

// Taken out again, the error is back.
await page.locator('#drive button[data-remove=delay]').click();
await until('the error is back', 120, async () => await page.locator('#drive button[data-remove=delay]').count() === 0 && await figure(/error at (1|1\.\d+|0\.9\d*) s/) > before / 2);

await browser.close();
finish();
