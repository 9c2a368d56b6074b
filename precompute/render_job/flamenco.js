// SPDX-License-Identifier: GPL-3.0-or-later

// A job type of Flamenco: put this file into the folder `scripts` beside the Flamenco Manager. DEFAULTS, above, are the
// values of the job that this file was written for.

const JOB_TYPE = {
    label: "Natural Gratings",
    description: "Bake gratings and render a job's pictures. Only Needs, Bake and the contact sheet need the extension.",
    settings: [
        { key: "job_file", type: "string", subtype: "file_path", required: true, default: DEFAULTS.job_file,
          description: "The job's TOML file" },
        { key: "output_dir", type: "string", subtype: "dir_path", required: true, default: DEFAULTS.output_dir,
          description: "Folder of the scenes, pictures and logs" },
        { key: "scripts_dir", type: "string", subtype: "dir_path", required: true, default: DEFAULTS.scripts_dir,
          description: "Folder of the worker, the bundle's scripts" },
        { key: "gratings", type: "string", required: true, default: DEFAULTS.gratings.join(","),
          description: "Names of the job's gratings, with commas between them" },
        { key: "parts", type: "int32", required: true, default: DEFAULTS.parts, propargs: { min: 1, max: 100000 },
          description: "Tasks for each grating" },
        { key: "pictures_per_task", type: "int32", required: true, default: DEFAULTS.pictures_per_task,
          propargs: { min: 1, max: 10000 }, description: "Pictures of a task" },
        { key: "threads", type: "int32", required: true, default: 0, propargs: { min: 0, max: 1024 },
          description: "Threads of a task; 0 for the scene's setting" },
        { key: "needs", type: "bool", required: false, default: DEFAULTS.needs,
          description: "Bake only the directions that the pictures show" },
    ],
};

function blenderTask(job, name, args, after) {
    const task = author.Task(name, "blender");
    task.addCommand(author.Command("exec", { exe: "{blender}", args: args }));
    for (const earlier of after) {
        task.addDependency(earlier);
    }
    job.addTask(task);
    return task;
}

function compileJob(job) {
    const settings = job.settings;
    const step = (name, extra) => ["--background", "--command", "grating", "job", settings.job_file,
        "-o", settings.output_dir, "--step", name].concat(extra);
    const frames = [];
    for (const grating of settings.gratings.split(",").map((name) => name.trim())) {
        let after = [];
        if (settings.needs) {
            after = [blenderTask(job, `needs-${grating}`, step("needs", ["--only", grating]), [])];
        }
        const bake = blenderTask(job, `bake-${grating}`, step("bake", ["--only", grating]), after);
        const plan = path.join(settings.output_dir, "scenes", grating + ".json");
        for (let part = 1; part <= settings.parts; part++) {
            const args = ["--background", "--factory-startup", "--python-exit-code", "1",
                "--python", path.join(settings.scripts_dir, "addon/rendering/start_worker.py"), "--", plan,
                "--task", String(part), "--per-task", String(settings.pictures_per_task),
                "--threads", String(settings.threads)];
            frames.push(blenderTask(job, `frames-${grating}-${part}`, args, [bake]));
        }
    }
    blenderTask(job, "contact-sheet", step("sheet", []), frames);
}
