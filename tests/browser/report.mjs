// node report.mjs FILE [NAME [model] [two-models]]: an HTML report opens from disk, offline, and is whole.
import { check, finish, launch, looks, open } from './browser.mjs';

const file = `file://${process.argv[2]}`;
const browser = await launch();
const { context, page } = await open(browser, file);
await context.setOffline(true);
await page.goto(file);
await page.waitForSelector('.chart canvas');

const charts = await page.locator('.chart canvas').count();
check(charts >= 6, `${charts} charts: overlay, residual, error curve, regimes, spectrum, whiteness are wanted`);
check(await page.locator('.verdict h2').first().innerText() !== '', 'the verdict has no words');
check(/truerate \w+/.test(await page.locator('.command code').last().innerText()), 'no command to run next');
check(await page.locator('.suspect, .steps .fall i').count() > 0, 'neither a suspect nor a step');
check(await page.locator('details dl').first().evaluate(d => d.children.length > 6), 'the card of an effect is empty');

// Hovering says the value with its unit, on every chart in view; dragging zooms; the keyboard too, and back.
const hover = async chart => {
  await chart.scrollIntoViewIfNeeded();
  const over = await chart.locator('.u-over').boundingBox();
  await page.mouse.move(over.x + over.width / 2, over.y + over.height / 2);
  return { over, legend: await chart.locator('.u-legend').innerText() };
};
const visible = await page.locator('.chart:visible').all();
const legends = [];
for (const chart of visible) legends.push((await hover(chart)).legend);
check(legends.every(legend => /\d/.test(legend)), `hovering says nothing: ${JSON.stringify(legends)}`);
check(legends.some(legend => legend.includes('°/s') && /τ:?\s*[\d.]/.test(legend)), `no error curve among ${JSON.stringify(legends)}`);
check(legends.some(legend => legend.includes('%') && /τ:?\s*[\d.]/.test(legend)), `no budget among ${JSON.stringify(legends)}`);
const chart = visible[0];
const { over } = await hover(chart);
await page.mouse.down();
await page.mouse.move(over.x + over.width * 0.7, over.y + over.height * 0.7, { steps: 4 });
await page.mouse.up();
check(await chart.evaluate(c => c.classList.contains('zoomed')), 'dragging does not zoom');
await chart.focus();
await page.keyboard.press('0');
check(!await chart.evaluate(c => c.classList.contains('zoomed')), 'the key 0 does not show the whole again');
await page.keyboard.press('+');
check(await chart.evaluate(c => c.classList.contains('zoomed')), 'the key + does not zoom');
await page.keyboard.press('0');

// Untouched, a legend names its lines and shows no empty value.
await page.mouse.move(2, 2);
await page.waitForTimeout(100);
const idle = await visible[0].locator('.u-legend').innerText();
check(!idle.includes('–') && /[a-z]/.test(idle), `an untouched legend reads ${JSON.stringify(idle)}`);

// One cursor over all charts of one quantity.
const { over: place } = await hover(page.locator('.chart[aria-label^="Rate"]').first());
check(place && await page.locator('.chart[aria-label^="Residual"]').first().evaluate(c => c.classList.contains('hovered')), 'the residual does not follow the cursor over the rate');

// Several axes: one at a time on the screen, all on paper.
const tabs = page.locator('[role=tab]');
const sections = page.locator('.axis');
const shown = async () => (await sections.evaluateAll(all => all.filter(a => a.offsetHeight > 0).length));
if (await tabs.count()) {
  check(await tabs.count() === await sections.count() && await shown() === 1, 'not one axis at a time');
  await tabs.nth(1).click();
  check(await sections.nth(1).isVisible() && !await sections.nth(0).isVisible(), 'the second tab does not show the second axis');
  check(await sections.nth(1).locator('.chart canvas').count() >= 6, 'the second axis has no charts');
  const legend = (await hover(sections.nth(1).locator('.chart').first())).legend;
  check(/\d/.test(legend), `hovering says nothing on the second axis: ${legend}`);
  await tabs.nth(1).press('ArrowLeft');
  check(await sections.nth(0).isVisible(), 'the arrow keys do not go through the tabs');
  await page.emulateMedia({ media: 'print' });
  check(await shown() === await sections.count(), 'an axis is missing on paper');
  await page.emulateMedia({ media: null });
  check(await page.locator('table.story tbody tr').count() >= await tabs.count(), 'no table of all axes');
}

// Two models are switched off and on.
const models = page.locator('button[data-model]');
for (const model of await models.all()) {
  const before = await page.locator('.chart[aria-label^="Rate"] canvas').first().evaluate(c => c.toDataURL());
  await model.click();
  await page.waitForTimeout(100);
  check(await page.locator('.chart[aria-label^="Rate"] canvas').first().evaluate(c => c.toDataURL()) !== before, 'a model is not switched off');
  await model.click();
}
if (process.argv.includes('two-models')) check(await models.count() === 2, 'two models have no two switches');

// The new model comes along.
const button = page.getByRole('button', { name: 'Download the new model' });
if (await button.count()) {
  const [download] = await Promise.all([page.waitForEvent('download'), button.click()]);
  const text = (await import('node:fs')).readFileSync(await download.path(), 'utf8');
  check(download.suggestedFilename().endsWith('.toml') && text.includes('truerate.model/1'), 'what is downloaded is no model');
} else check(!process.argv.includes('model'), 'no button for the new model');

await looks(page, process.argv[3] || 'report');
await browser.close();
finish();
