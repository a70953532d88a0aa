; Slots of facts that are read after a retract or modify of the fact, in the bodies of queries, one in the other.

(deftemplate item (slot name) (slot count (default 0)) (multislot tags))
(deftemplate shelf (slot name) (multislot items))
(deffacts start (item (name a) (tags x y)) (item (name b) (count 2)) (item (name c) (count 3) (tags z))
  (shelf (name top) (items a b)) (shelf (name low) (items c)) (go 1))

(deffunction drop (?name)
  (do-for-fact ((?i item)) (eq ?i:name ?name)
    (bind ?before ?i:count)
    (if (> ?i:count 2) then (retract ?i) else (modify ?i (count (+ ?i:count 10))))
    (printout t "dropped " ?i:name " of " ?i:count ", was " ?before " with " ?i:tags crlf)
    ?i:name))

(defrule clean ?g <- (go 1) =>
  (retract ?g)
  (printout t "result " (drop a) " " (drop c) crlf)
  (do-for-all-facts ((?s shelf)) TRUE
    (retract ?s)
    (do-for-all-facts ((?other item)) (member$ ?other:name ?s:items)
      (printout t ?s:name ": " ?other:name " of " ?s:items crlf)))
  (assert (go 2)))

(defrule count-down ?g <- (go 2) =>
  (retract ?g)
  (delayed-do-for-all-facts ((?i item)) TRUE
    (retract ?i)
    (while (> (length$ ?i:tags) 5) do (printout t "never" crlf))
    (printout t "gone ; (retract ?i) " ?i:name " " ?i:tags crlf)
    (assert (was ?i:name ?i:count))))
