"use strict";
(async () => {
  const description = await (await fetch("/openapi.json")).json();
  const element = (name, className, text) => {
    const made = document.createElement(name);
    if (className) made.className = className;
    if (text !== undefined) made.textContent = text;
    return made;
  };
  const resolved = (schema) => {
    const name = schema && schema.$ref && schema.$ref.split("/").pop();
    return name ? description.components.schemas[name] : schema || {};
  };
  const kind = (schema) => {
    if (schema.$ref) return schema.$ref.split("/").pop();
    if (schema.anyOf) return schema.anyOf.map(kind).filter((name) => name !== "null").join(" or ");
    if (schema.type === "array") return `list of ${kind(schema.items || {})}`;
    return schema.format || (schema.contentMediaType ? "file" : schema.type) || "value";
  };
  const range = ({ minimum, maximum }) => (minimum !== undefined && maximum !== undefined ? ` ${minimum} to ${maximum}` : "");
  const table = (title, rows) => {
    const made = element("table");
    const head = element("caption", "quiet", title);
    made.append(head, ...rows.map(([name, what]) => {
      const row = element("tr");
      const cell = element("th");
      cell.scope = "row";
      cell.append(element("code", "", name));
      row.append(cell, element("td", "", what));
      return row;
    }));
    return made;
  };
  const fields = (schema, required = []) => Object.entries(schema.properties || {}).map(([name, field]) =>
    [name, [`${kind(field)}${range(field)}`, required.includes(name) ? "required" : field.default !== undefined ? `default ${field.default}` : "", field.description || ""].filter(Boolean).join("; ")]);
  for (const [path, verbs] of Object.entries(description.paths)) {
    for (const [verb, operation] of Object.entries(verbs)) {
      const section = element("section");
      const heading = element("h2");
      heading.append(element("span", "verb", verb.toUpperCase()), element("code", "", path));
      section.append(heading, element("p", "", operation.summary));
      const given = (operation.parameters || []).map((p) => [p.name, `${kind(p.schema)}${range(p.schema)}${p.required ? "; required" : `; default ${p.schema.default}`}`]);
      const content = operation.requestBody && Object.values(operation.requestBody.content)[0];
      const body = content ? resolved(content.schema) : {};
      const takes = [...given, ...fields(body, body.required)];
      if (takes.length) section.append(table(content ? "Takes, as multipart/form-data" : "Takes", takes));
      const reply = Object.values(operation.responses["200"].content || {})[0];
      const many = reply && reply.schema && reply.schema.type === "array";
      const gives = reply && reply.schema ? fields(resolved(many ? reply.schema.items : reply.schema)) : [];
      if (gives.length) section.append(table(many ? "Gives a list of" : "Gives", gives));
      const refusals = Object.entries(operation.responses).filter(([status]) => +status >= 400).map(([status, { description: why }]) => [status, why]);
      section.append(table("Refuses, with {\"error\": why}", refusals));
      document.getElementById("paths").append(section);
    }
  }
  document.documentElement.dataset.ready = "true";
})();
